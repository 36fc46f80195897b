/** What is asked: a slider for each control, who moves, and back to where it began. */

import { button, el, id } from "./dom.ts";
import type { Mount } from "./page.ts";
import { presets } from "./presets.ts";
import type { Session } from "./session.ts";
import { Slider } from "./slider.ts";

export function mount(host: HTMLElement, page: Session): void {
  const { card, player, signal, store } = page;
  const row = presets(page);
  const sliders = card.controls.map((control, column) => {
    const examples = card.examples.map((row) => row[column]!);
    const set = (value: number) =>
      store.set({ controls: { ...store.state.controls, [control.name]: value } });
    return [control.name, new Slider(control, examples, set)] as const;
  });
  const start = Object.fromEntries(card.controls.map(({ name, default: value }) => [name, value]));
  const reset = button("Reset all", "Reset all controls (R)", () => store.set({ controls: start }));
  reset.dataset["act"] = "reset";
  const show = () => {
    for (const [name, slider] of sliders) slider.show(store.state.controls[name]!);
  };
  host.append(
    el("div", { class: "title" }, el("h2", {}, "Controls"), reset),
    ...(row ? [row] : []),
    ...sliders.map(([, slider]) => slider.element),
  );
  if (card.performers.length) host.append(performers(card.performers, store, signal));
  show();
  const leave = store.listen((_, changed) => {
    if (changed.has("controls")) show();
  });
  signal.addEventListener("abort", leave);
  player.onTrust(({ deviations = [] }) => {
    for (const [name, slider] of sliders) {
      slider.tell(deviations.find(({ control }) => control === name) ?? null);
    }
  });
}

const NOBODY = "Unknown performer";

function performers(
  names: readonly string[],
  store: Parameters<Mount>[1]["store"],
  signal: AbortSignal,
): HTMLElement {
  const label = id();
  const options = names.map((name) => el("option", { value: name }, name));
  const select = el("select", { id: label }, el("option", { value: "" }, NOBODY), ...options);
  const show = () => {
    select.value = store.state.performer ?? "";
  };
  select.addEventListener("change", () => store.set({ performer: select.value || null }));
  show();
  signal.addEventListener("abort", store.listen(show));
  return el("div", { class: "field" }, el("label", { for: label }, "Performer"), select);
}
