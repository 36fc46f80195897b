/** The fields of a segment: what a walk, an act and a hold are asked to be. */

import { el } from "../dom.ts";
import type { Desk } from "./desk.ts";
import { all, curve, type Fields, folded, number, place, select } from "./fields.ts";
import { pathFields } from "./path-fields.ts";
import { type Act, type Hold, type Kind, put, type Segment, type Walk } from "./script.ts";
import { targetFields } from "./target-fields.ts";

const GAITS = [
  ["rolling", "at full speed"],
  ["standing", "standing"],
] as const;
const BLENDS = [
  ["auto", "automatic"],
  ["dead", "dead blending"],
  ["hermite", "Hermite"],
  ["cut", "cut"],
] as const;
/** Controls of a walk that its way decides. */
const STEERED: ReadonlySet<string> = new Set(["speed", "turn"]);

/** How a field of the segment with that index is read and written. */
export interface Editing<Own extends Segment> {
  readonly desk: Desk;
  readonly index: number;
  now(): Own;
  set(name: string, value: unknown): void;
}

export function segmentFields(desk: Desk, index: number): Fields {
  const editing = <Own extends Segment>(): Editing<Own> => ({
    desk,
    index,
    now: () => desk.script!.segments[index] as Own,
    set: (name, value) => desk.change(put(desk.script!.segments[index]!, name, value), index),
  });
  const made: Readonly<Record<Kind, () => Fields[]>> = {
    walk: () => walkFields(editing<Walk>()),
    act: () => actFields(editing<Act>()),
    hold: () => holdFields(editing<Hold>()),
  };
  const { kind } = desk.script!.segments[index]!;
  return all(made[kind](), el("div", { class: "segment-fields" }));
}

/** What the form of a segment depends on; with another one it is made anew. */
export function shape(segment: Segment): string {
  if (segment.kind === "hold") return segment.kind;
  const targets =
    segment.kind === "act" ? (segment.targets ?? []).map(({ time }) => time === undefined) : [];
  const way =
    segment.kind === "walk"
      ? [segment.along?.length, !segment.to, segment.seconds === undefined]
      : [];
  return JSON.stringify([segment.kind, segment.model, targets, way]);
}

function walkFields(editing: Editing<Walk>): Fields[] {
  const { now, set } = editing;
  return [
    modelField(editing),
    ...pathFields(editing),
    curve(
      { at: "speed", word: "Speed", unit: "m/s", empty: "mean captured" },
      () => now().speed,
      (value) => set("speed", value),
    ),
    select(
      { at: "start", word: "Begins" },
      GAITS,
      () => now().start ?? "rolling",
      (value) => set("start", value === "rolling" ? undefined : value),
    ),
    select(
      { at: "stop", word: "Ends" },
      GAITS,
      () => now().stop ?? "rolling",
      (value) => set("stop", value === "rolling" ? undefined : value),
    ),
    ...movingFields(editing),
  ];
}

function actFields(editing: Editing<Act>): Fields[] {
  const { now, set } = editing;
  return [
    modelField(editing),
    ...targetFields(editing),
    place(
      { at: "at", word: "Place", unit: "m", empty: "follows" },
      ["x", "z"],
      () => now().at,
      (value) => set("at", value),
    ),
    number(
      { at: "facing", word: "Facing", unit: "rad, left of +Z", empty: "follows" },
      () => now().facing,
      (value) => set("facing", value),
    ),
    ...movingFields(editing),
  ];
}

function holdFields(editing: Editing<Hold>): Fields[] {
  const { desk, now, set } = editing;
  const joints = desk.performed?.names ?? [];
  return [
    number(
      { at: "seconds", word: "Duration", unit: "s" },
      () => now().seconds,
      (value) => set("seconds", value),
    ),
    select(
      { at: "joint", word: "Keeps in place" },
      [["", "no joint"], ...joints.map((name) => [name, name] as const)],
      () => now().joint ?? "",
      (value) => set("joint", value || undefined),
    ),
    place(
      { at: "look_at", word: "Looks at", unit: "m", empty: "ahead" },
      ["x", "y", "z"],
      () => now().look_at,
      (value) => set("look_at", value),
    ),
  ];
}

function modelField({ desk, now, set }: Editing<Walk> | Editing<Act>): Fields {
  const names = desk.models.names(now().kind).map((name) => [name, name] as const);
  return select(
    { at: "model", word: "Model" },
    names,
    () => now().model,
    (value) => set("model", value),
  );
}

/** What walks and acts share: who moves, other controls, and the join. */
function movingFields(editing: Editing<Walk> | Editing<Act>): Fields[] {
  const { desk, index, now, set } = editing;
  const card = desk.models.card(now().model);
  const found: Fields[] = [];
  if (card?.performers.length)
    found.push(
      select(
        { at: "performer", word: "Performer" },
        [["", "nobody"], ...card.performers.map((name) => [name, name] as const)],
        () => now().performer ?? "",
        (value) => set("performer", value || undefined),
      ),
    );
  const free = (card?.controls ?? []).filter(
    ({ name }) => now().kind === "act" || !STEERED.has(name),
  );
  if (free.length)
    found.push(
      folded(
        `Controls (${free.length})`,
        free.map(({ name, unit }) =>
          number(
            { at: `controls/${name}`, word: name.replaceAll("_", " "), unit, empty: "inferred" },
            () => now().controls?.[name],
            (value) => set("controls", put(now().controls ?? {}, name, value)),
          ),
        ),
      ),
    );
  if (index > 0) found.push(joinFields(editing));
  return found;
}

function joinFields({ now, set }: Editing<Walk> | Editing<Act>): Fields {
  const own = (name: string, value: unknown) => set("join", put(now().join ?? {}, name, value));
  return folded("Join with the segment before", [
    select(
      { at: "join/blend", word: "Blend" },
      BLENDS,
      () => now().join?.blend ?? "auto",
      (value) => own("blend", value === "auto" ? undefined : value),
    ),
    number(
      { at: "join/seconds", word: "Blended over", unit: "s", empty: "automatic" },
      () => now().join?.seconds,
      (value) => own("seconds", value),
    ),
    select(
      { at: "join/cut", word: "Cut" },
      [
        ["best", "where poses are most alike"],
        ["end", "at the last and the first frame"],
      ],
      () => now().join?.cut ?? "best",
      (value) => own("cut", value === "best" ? undefined : value),
    ),
    number(
      { at: "join/most", word: "Refused beyond", unit: "m", empty: "never" },
      () => now().join?.most,
      (value) => own("most", value),
    ),
  ]);
}
