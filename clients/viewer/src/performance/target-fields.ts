/** Targets of an act: which joint shall be where, and when. */

import { el } from "../dom.ts";
import { placed, place as placeJoints } from "../skeleton.ts";
import { act, all, type Fields, number, place, select } from "./fields.ts";
import { type Act, type Point, put, type Target } from "./script.ts";
import type { Editing } from "./segment-fields.ts";

const MOMENTS = [
  ["start", "at the start"],
  ["event", "at the event"],
  ["end", "at the end"],
  ["time", "after some seconds"],
] as const;
const FRAMES = [
  ["world", "the world"],
  ["segment", "the segment"],
] as const;

export function targetFields(editing: Editing<Act>): Fields[] {
  const { now, set } = editing;
  const targets = () => now().targets ?? [];
  const rows = targets().map((_, i) => targetField(editing, i));
  const add = act("Add a target", "Add a target of this act", "targets/add", () =>
    set("targets", [...targets(), suggested(editing)]),
  );
  const list = all(rows, el("div", { class: "targets" }));
  list.element.append(add);
  return [list];
}

function targetField({ desk, now, set }: Editing<Act>, i: number): Fields {
  const at = `targets/${i}`;
  const own = (): Target => now().targets![i]!;
  const write = (target: Target) => set("targets", now().targets!.with(i, target));
  const joints = desk.models.card(now().model)?.skeleton.names ?? [];
  const timed = own().time !== undefined;
  const parts = [
    select(
      { at: `${at}/joint`, word: "Joint" },
      joints.map((name) => [name, name]),
      () => own().joint,
      (joint) => write(put(own(), "joint", joint)),
    ),
    place(
      { at: `${at}/position`, word: "Position", unit: "m" },
      ["x", "y", "z"],
      () => own().position,
      (value) => write(put(own(), "position", value)),
    ),
    select(
      { at: `${at}/at`, word: "When" },
      MOMENTS,
      () => own().at ?? "time",
      (value) => write(moment(own(), value)),
    ),
    ...(timed
      ? [
          number(
            { at: `${at}/time`, word: "After", unit: "s" },
            () => own().time,
            (value) => write(put(own(), "time", value)),
          ),
        ]
      : []),
    select(
      { at: `${at}/frame`, word: "In the frame of" },
      FRAMES,
      () => own().frame ?? "world",
      (value) => write(put(own(), "frame", value === "world" ? undefined : value)),
    ),
  ];
  const host = el("fieldset", {}, el("legend", {}, `Target ${i + 1} `));
  const remove = act("×", `Delete target ${i + 1}`, `${at}/delete`, () =>
    set("targets", now().targets!.toSpliced(i, 1)),
  );
  host.firstElementChild!.append(remove);
  return all(parts, host);
}

function moment(target: Target, value: string): Target {
  const bare = put(put(target, "at", undefined), "time", undefined);
  return value === "time" ? put(bare, "time", 0.5) : put(bare, "at", value);
}

/** The model's own joint, where it is now at that moment: what can be reached for certain. */
function suggested({ desk, index, now }: Editing<Act>): Target {
  const card = desk.models.card(now().model);
  const names = card?.skeleton.names ?? [];
  const joint = names[card?.event?.joint ?? names.length - 1] ?? "";
  const at = card?.event ? "event" : "end";
  return { joint, position: found(desk, index, joint) ?? [0, 1.2, 0.5], at };
}

function found(desk: Editing<Act>["desk"], index: number, joint: string): Point | null {
  const { performed } = desk;
  const segment = performed?.report.segments[index];
  const which = performed?.names.indexOf(joint) ?? -1;
  if (!performed || !segment || which < 0) return null;
  const { offsets, parents, track } = performed;
  const time = segment.event ?? segment.ends;
  const frame = Math.min(track.times.length - 1, Math.round(time * track.rate));
  const joints = placed(parents.length);
  placeJoints(joints, parents, offsets, track.rotations, track.rootPosition, frame);
  const [x, y, z] = joints.positions.subarray(3 * which, 3 * which + 3);
  return [x, y, z].map((value) => Math.round(1000 * value!) / 1000) as unknown as Point;
}
