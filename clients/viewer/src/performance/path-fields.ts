/** Where a walk goes: along points, to one, for some seconds, or to where the next segment begins. */

import { el } from "../dom.ts";
import { act, all, curve, type Fields, number, place, select } from "./fields.ts";
import { type FloorPoint, points, put, type Walk } from "./script.ts";
import type { Editing } from "./segment-fields.ts";

const WAYS = [
  ["along", "along points"],
  ["to", "to a point"],
  ["seconds", "for some seconds"],
  ["next", "to where the next segment begins"],
] as const;

type Way = (typeof WAYS)[number][0];

export function wayOf({ along, seconds, to }: Walk): Way {
  if (along) return "along";
  if (to) return "to";
  return seconds === undefined ? "next" : "seconds";
}

/** The same walk on another kind of way; what it has of a path stays. */
export function rerouted(walk: Walk, way: Way, ahead: FloorPoint): Walk {
  const path = points(walk);
  const [first, last] = [path[0] ?? ahead, path.at(-1) ?? ahead];
  const bare = ["along", "to", "seconds", "turn"].reduce(
    (rest, name) => put(rest, name, undefined),
    walk,
  );
  if (way === "along") return put(bare, "along", path.length ? path : [first]);
  if (way === "to") return put(bare, "to", last);
  return way === "seconds" ? put(bare, "seconds", 3) : bare;
}

export function pathFields(editing: Editing<Walk>): Fields[] {
  const { desk, index, now, set } = editing;
  const way = select(
    { at: "way", word: "Walks" },
    WAYS,
    () => wayOf(now()),
    (value) => desk.change(rerouted(now(), value as Way, ahead(editing)), index),
  );
  const kind = wayOf(now());
  if (kind === "seconds")
    return [
      way,
      number(
        { at: "seconds", word: "Duration", unit: "s" },
        () => now().seconds,
        (value) => set("seconds", value),
      ),
      curve(
        { at: "turn", word: "Turns", unit: "rad/s, left is positive", empty: "straight ahead" },
        () => now().turn,
        (value) => set("turn", value),
      ),
    ];
  if (kind === "to")
    return [
      way,
      place(
        { at: "to", word: "Point", unit: "m" },
        ["x", "z"],
        () => now().to,
        (value) => set("to", value),
      ),
    ];
  return kind === "along" ? [way, pointList(editing)] : [way];
}

/** The points in words, for who does not draw on the floor. */
function pointList({ index, now, set }: Editing<Walk>): Fields {
  const change = (along: readonly FloorPoint[]) => set("along", along);
  const rows = points(now()).map((_, i) => {
    const row = place(
      { at: `along/${i}`, word: `Point ${i + 1}`, unit: "m" },
      ["x", "z"],
      () => points(now())[i],
      (value) => change(points(now()).with(i, value as unknown as FloorPoint)),
    );
    const remove = act("×", `Delete point ${i + 1}`, `along/${i}/delete`, () =>
      change(points(now()).toSpliced(i, 1)),
    );
    remove.disabled = points(now()).length < 2;
    row.element.querySelector(".axes")!.append(remove);
    return row;
  });
  const add = act("Add a point", "Add a point at the end of the path", "along/add", () =>
    change([...points(now()), beyond(points(now()))]),
  );
  const hint = el(
    "p",
    { class: "about" },
    "Or choose Draw path on the stage, and click on the floor. Points can be dragged there.",
  );
  const list = all(rows, el("div", { class: "points", "data-segment": index }));
  list.element.append(add, hint);
  return list;
}

/** Where a segment begins, and two metres on. */
function ahead({ desk, index }: Editing<Walk>): FloorPoint {
  const found = desk.report?.segments[index];
  if (!found) return [0, 3];
  const [x, z] = found.place;
  return [rounded(x + 3 * Math.sin(found.heading)), rounded(z + 3 * Math.cos(found.heading))];
}

/** A point as far on as the last two are from each other. */
export function beyond(path: readonly FloorPoint[]): FloorPoint {
  const [x, z] = path.at(-1) ?? [0, 0];
  const [px, pz] = path.at(-2) ?? [0, 0];
  const way = Math.hypot(x - px, z - pz);
  if (way < 0.5) return [x, rounded(z + 2)];
  return [rounded(x + (2 * (x - px)) / way), rounded(z + (2 * (z - pz)) / way)];
}

/** To centimetres: finer than anybody points. */
export function rounded(value: number): number {
  return Math.round(100 * value) / 100;
}
