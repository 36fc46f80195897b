/** What is asked: a slider for each control, who moves, and back to where it began. */

import { button, chooser, el, labelled } from "./dom.ts";
import { otherSets } from "./examples.ts";
import type { Mount } from "./page.ts";
import { presets } from "./presets.ts";
import type { Session } from "./session.ts";
import { Slider, title } from "./slider.ts";

export function mount(host: HTMLElement, page: Session): void {
  const { card, player, signal, source, store } = page;
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
  for (const set of otherSets(card)) {
    const open = source.open?.includes(set.name) ?? false;
    host.append(labels(set, open, store, signal));
  }
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

type Store = Parameters<Mount>[1]["store"];

function performers(names: readonly string[], store: Store, signal: AbortSignal): HTMLElement {
  const set = (name: string) => store.set({ performer: name || null });
  const select = names_of("performer", names, set);
  return shown("Performer", select, () => store.state.performer ?? "", { store, signal });
}

/** A selector of one name of a label set, such as a style; open: all answers leave it open. */
function labels(
  { name, names }: { readonly name: string; readonly names: readonly string[] },
  open: boolean,
  store: Store,
  signal: AbortSignal,
): HTMLElement {
  const select = names_of(name, names, (label) => {
    const { [name]: _, ...others } = store.state.labels;
    store.set({ labels: label ? { ...others, [name]: label } : others });
  });
  select.disabled = open;
  if (open) select.title = "This copy has no answers for single names; a service has";
  return shown(title(name), select, () => store.state.labels[name] ?? "", { store, signal });
}

function names_of(set: string, names: readonly string[], taken: (name: string) => void) {
  const open = ["", `Unknown ${set}`] as const;
  return chooser([open, ...names.map((name) => [name, name] as const)], "", taken);
}

/** A select with a word, which follows the state. */
function shown(
  word: string,
  select: HTMLSelectElement,
  value: () => string,
  { store, signal }: { readonly store: Store; readonly signal: AbortSignal },
): HTMLElement {
  const show = () => {
    select.value = value();
  };
  show();
  signal.addEventListener("abort", store.listen(show));
  return labelled(word, select);
}
