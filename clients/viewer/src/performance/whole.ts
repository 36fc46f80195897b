/** What holds for the whole performance: where it begins, its frame rate and its take. */

import { LARGEST_SEED } from "../takes.ts";
import type { Desk } from "./desk.ts";
import { folded, number, place, select } from "./fields.ts";
import { put } from "./script.ts";

export function mount(host: HTMLElement, desk: Desk): void {
  const start = () => desk.script?.start ?? {};
  const set = (name: string, value: unknown) => {
    if (desk.script) desk.edit(put(desk.script, name, value));
  };
  const fields = folded("Whole performance", [
    place(
      { at: "/start/position", word: "Begins at", unit: "m", empty: "0" },
      ["x", "z"],
      () => start().position,
      (value) => set("start", put(start(), "position", value)),
    ),
    number(
      { at: "/start/heading", word: "Heading", unit: "rad, left of +Z", empty: "0" },
      () => start().heading,
      (value) => set("start", put(start(), "heading", value)),
    ),
    number(
      { at: "/fps", word: "Frames a second", empty: "30" },
      () => desk.script?.fps,
      (value) => set("fps", value),
    ),
    number(
      { at: "/take", word: `Take, 0 to ${LARGEST_SEED}`, empty: "the prediction" },
      () => desk.script?.take,
      (value) => set("take", value),
    ),
    select(
      { at: "/feet", word: "Feet" },
      [
        ["stand", "stand"],
        ["as_predicted", "as predicted"],
      ],
      () => desk.script?.feet ?? "stand",
      (value) => set("feet", value === "stand" ? undefined : value),
    ),
  ]);
  fields.element.classList.add("whole");
  host.append(fields.element);
  desk.listen((change) => {
    if (change === "script") fields.show();
  });
}
