/** Named points of the controls, from the model's recipe, as buttons. */

import type { ModelCard } from "@posefield/client";

import { el } from "./dom.ts";
import type { Page } from "./page.ts";
import { title } from "./slider.ts";
import type { State } from "./state.ts";

type Preset = NonNullable<ModelCard["presets"]>[number];

/** A row of buttons; null for a model without presets. */
export function presets({ card, store, signal }: Page): HTMLElement | null {
  const all = card.presets ?? [];
  if (!all.length) return null;
  const buttons = all.map((preset) => {
    const made = el("button", { type: "button" }, title(preset.name));
    const { controls, performer } = preset;
    const labels = { ...preset.labels };
    const set = () => store.set({ controls: { ...controls }, performer, labels });
    made.addEventListener("click", set);
    return made;
  });
  const show = () => {
    for (const [i, each] of buttons.entries())
      each.setAttribute("aria-pressed", String(holds(store.state, all[i]!)));
  };
  show();
  signal.addEventListener("abort", store.listen(show));
  return el("div", { class: "presets", role: "group", "aria-label": "Presets" }, ...buttons);
}

/** Whether a state is at a preset's point. */
export function holds({ controls, labels, performer }: State, preset: Preset): boolean {
  const same = Object.entries(preset.controls).every(([name, value]) => controls[name] === value);
  const named = preset.labels ?? {};
  const alike = [...Object.keys(named), ...Object.keys(labels)].every(
    (name) => named[name] === labels[name],
  );
  return same && alike && performer === (preset.performer ?? null);
}
