/** The question: a slider for each control, presets, the performer and other labels. */

import type { ModelCard, Trust } from "@posefield/client";

import { button, chooser, el, icon, id, labelled, svg, textButton, titled } from "./dom.ts";
import { type Control, otherSets } from "./examples.ts";
import type { Session } from "./player.ts";
import { has, type State } from "./state.ts";
import * as written from "./written.ts";
import { title } from "./written.ts";

type Preset = NonNullable<ModelCard["presets"]>[number];

export function mount(host: HTMLElement, session: Session): void {
  const { card, player, signal, store } = session;
  const sliders = card.controls.map((control, column) => {
    const examples = card.examples.map((row) => row[column]!);
    const set = (value: number | null) => {
      const { [control.name]: _, ...others } = store.state.controls;
      store.set({ controls: value === null ? others : { ...others, [control.name]: value } });
    };
    return [control.name, new Slider(control, examples, set)] as const;
  });
  const reset = button("Reset all", "Reset all controls (R)", () => store.set({ controls: {} }));
  reset.dataset["act"] = "reset";
  host.append(titled("Controls", reset));
  if (card.presets?.length) host.append(presets(card.presets, session));
  host.append(...sliders.map(([, slider]) => slider.element));
  const choose = (set: string, names: readonly string[], take: (name: string) => void) =>
    chooser([["", `Unseen ${set}`], ...names.map((name) => [name, name] as const)], "", take);
  if (card.performers.length) {
    const list = choose("performer", card.performers, (name) =>
      store.set({ performer: name || null }),
    );
    store.follow(({ performer }) => {
      list.value = performer ?? "";
    }, signal);
    host.append(labelled("Performer", list));
  }
  for (const { name, names } of otherSets(card)) {
    const list = choose(name, names, (label) => {
      const { [name]: _, ...others } = store.state.labels;
      store.set({ labels: label ? { ...others, [name]: label } : others });
    });
    store.follow(({ labels }) => {
      list.value = labels[name] ?? "";
    }, signal);
    host.append(labelled(title(name), list));
  }
  const show = () => {
    const { controls, inferred } = store.state;
    for (const [name, slider] of sliders)
      slider.show(controls[name] ?? inferred[name]!, !Object.hasOwn(controls, name));
  };
  show();
  store.listen((_, changed) => {
    if (has(changed, "controls", "inferred")) show();
  }, signal);
  player.onTrust(({ deviations = [] }) => {
    for (const [name, slider] of sliders)
      slider.showDeviation(deviations.find(({ control }) => control === name) ?? null);
  });
}

/** Named points of the controls, from the model's recipe, as buttons. */
function presets(all: readonly Preset[], { store, signal }: Session): HTMLElement {
  const buttons = all.map(({ name, controls, performer, labels }) =>
    textButton(title(name), () =>
      store.set({ controls: { ...controls }, performer, labels: { ...labels } }),
    ),
  );
  store.follow((state) => {
    for (const [i, element] of buttons.entries())
      element.setAttribute("aria-pressed", String(isAt(state, all[i]!)));
  }, signal);
  return el("div", { class: "presets row", role: "group", "aria-label": "Presets" }, ...buttons);
}

/** Tell whether the state is at a preset. */
export function isAt({ controls, labels, performer }: State, preset: Preset): boolean {
  const named = preset.labels ?? {};
  return (
    Object.entries(preset.controls).every(([name, value]) => controls[name] === value) &&
    [...Object.keys(named), ...Object.keys(labels)].every((name) => named[name] === labels[name]) &&
    performer === (preset.performer ?? null)
  );
}

/** Share of the sampled range by which a slider goes beyond it on either side. */
const BEYOND = 0.25;
const STEPS = 1500;
/** Steps of a key: one moves by two hundredths of the sampled range. */
const [STEP, KEYS] = [
  20,
  { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 },
] as const;

/** A slider over the sampled range and beyond, with captured clips as ticks, and its number. */
class Slider {
  readonly element: HTMLElement;
  readonly #control: Control;
  readonly #range = el("input", { type: "range", min: 0, max: STEPS, step: 1 });
  readonly #number = el("input", { type: "text", inputmode: "decimal", autocomplete: "off" });
  readonly #mark = el("span", { class: "mark" });
  readonly #fault = el("p", { class: "fault", role: "alert", id: id() });
  readonly #given = el("p", { class: "given", "data-given": "" });
  readonly #reset: HTMLButtonElement;
  readonly #set: (value: number | null) => void;
  #value: number;

  /** examples: values of captured clips. set: called with null to leave the control open. */
  constructor(control: Control, examples: readonly number[], set: (value: number | null) => void) {
    this.#control = control;
    this.#value = control.default;
    this.#set = set;
    const { description, minimum, maximum, unit } = control;
    const name = title(control.name);
    this.#reset = button(icon("reset"), `Reset ${name}`, () => set(null));
    const [label, about] = [id(), id()];
    this.#range.setAttribute("aria-labelledby", label);
    this.#range.setAttribute("aria-describedby", about);
    this.#number.setAttribute("aria-label", `${name} in ${unit || "numbers"}`);
    this.#range.addEventListener("input", () => set(this.#snapped()));
    this.#range.addEventListener("keydown", (event) => this.#press(event));
    this.#number.addEventListener("change", () => this.#enter());
    const [low, high] = [minimum, maximum].map((value) => written.short(value, maximum - minimum));
    const sampled = `${description ? `${description}. ` : ""}Sampled ${low} to ${high} ${unit}`;
    this.element = el(
      "div",
      { class: "control", "data-control": control.name },
      el(
        "div",
        { class: "head" },
        el("span", { class: "name", id: label }, name),
        this.#mark,
        el("span", { class: "typed" }, this.#number, el("span", { class: "unit" }, unit)),
        this.#reset,
      ),
      ticks(control, examples),
      this.#range,
      this.#fault,
      this.#given,
      el("p", { class: "about", id: about }, sampled),
    );
    this.show(control.default, true);
  }

  /** open: the value was inferred. */
  show(value: number, open: boolean): void {
    this.#value = value;
    const { minimum, maximum, unit } = this.#control;
    const outside = value < minimum || value > maximum;
    this.#range.value = String(Math.round(STEPS * share(this.#control, value)));
    this.#range.setAttribute(
      "aria-valuetext",
      `${this.#text()} ${unit}${outside ? ", outside what was sampled" : open ? ", inferred" : ""}`,
    );
    if (document.activeElement !== this.#number) this.#number.value = this.#text();
    this.element.toggleAttribute("data-outside", outside);
    this.#mark.textContent = outside ? "outside" : open ? "inferred" : "";
    this.#reset.disabled = open;
    this.#refuse("");
  }

  /** Say which value the motion has, where that is not the requested one. */
  showDeviation(deviation: NonNullable<Trust["deviations"]>[number] | null): void {
    const { minimum, maximum, unit } = this.#control;
    const value = deviation && written.short(deviation.given, maximum - minimum);
    this.#given.textContent = deviation
      ? `Given ${value} ${unit}: ${deviation.side} what was asked.`
      : "";
  }

  /** Return the slider's value; the nearest sampled one, where those are few. */
  #snapped(): number {
    const { minimum, maximum, values } = this.#control;
    const [least, most] = ends(this.#control);
    const value = least + (Number(this.#range.value) / STEPS) * (most - least);
    if (!values.length || value < minimum || value > maximum) return Number(value.toPrecision(5));
    return values.reduce((best, other) =>
      Math.abs(other - value) < Math.abs(best - value) ? other : best,
    );
  }

  /** Move by steps, or to the next of few values. */
  #press(event: KeyboardEvent): void {
    const count = KEYS[event.key as keyof typeof KEYS] ?? 0;
    if (!count || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const next = this.#control.values
      .toSorted((a, b) => Math.sign(count) * (a - b))
      .find((value) => Math.sign(count) * (value - this.#value) > 1e-9);
    this.#range.valueAsNumber += STEP * count;
    this.#set(next ?? this.#snapped());
  }

  #enter(): void {
    const value = written.read(this.#number.value);
    this.#refuse(typeof value === "string" ? value : "");
    if (typeof value === "string") return;
    this.#set(value);
    this.#number.value = this.#text();
  }

  #refuse(text: string): void {
    this.#fault.textContent = text;
    this.#number.setAttribute("aria-invalid", String(!!text));
    if (text) this.#number.setAttribute("aria-describedby", this.#fault.id);
    else this.#number.removeAttribute("aria-describedby");
  }

  #text(): string {
    return written.short(this.#value, this.#control.maximum - this.#control.minimum);
  }
}

function ends({ minimum, maximum }: Control): readonly [number, number] {
  const beyond = BEYOND * (maximum - minimum || 1);
  return [minimum - beyond, maximum + beyond];
}

function share(control: Control, value: number): number {
  const [least, most] = ends(control);
  return Math.min(1, Math.max(0, (value - least) / (most - least)));
}

/** The sampled range as a band, and a line for each captured clip. */
function ticks(control: Control, examples: readonly number[]): SVGSVGElement {
  const at = (value: number) => (1000 * share(control, value)).toFixed(1);
  const lines = [...new Set(examples.map(at))].map((x) => `M${x} 0V10`).join("");
  const [from, to] = [at(control.minimum), at(control.maximum)];
  const width = Number(to) - Number(from);
  return svg(
    "svg",
    { viewBox: "0 0 1000 10", preserveAspectRatio: "none", "aria-hidden": "true", class: "ticks" },
    svg("rect", { x: 0, y: 6.5, width: 1000, height: 1, class: "beyond" }),
    svg("rect", { x: from, y: 6, width, height: 2, class: "sampled" }),
    svg("path", { d: lines, "vector-effect": "non-scaling-stroke" }),
  );
}
