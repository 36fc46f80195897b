/** One control: a slider over what was sampled and a quarter beyond, examples as ticks, a number. */

import type { ModelCard, Trust } from "@posefield/client";

import { button, el, icon, id, svg } from "./dom.ts";
import * as written from "./written.ts";

type Deviation = NonNullable<Trust["deviations"]>[number];
export type Control = ModelCard["controls"][number];

/** Share of the sampled range by which a slider goes beyond it on either side. */
export const BEYOND = 0.25;
const STEPS = 1500;

export class Slider {
  readonly element: HTMLElement;
  readonly #control: Control;
  readonly #range = el("input", { type: "range", min: 0, max: STEPS, step: 1 });
  readonly #number = el("input", { type: "text", inputmode: "decimal", autocomplete: "off" });
  readonly #mark = el("span", { class: "mark" });
  readonly #fault = el("p", { class: "fault", role: "alert" });
  readonly #given = el("p", { class: "given", "data-given": "" });
  readonly #reset: HTMLButtonElement;
  readonly #set: (value: number) => void;
  #value: number;

  /** examples: of this control, in its unit. */
  constructor(control: Control, examples: readonly number[], set: (value: number) => void) {
    this.#control = control;
    this.#value = control.default;
    this.#set = set;
    const name = title(control.name);
    this.#reset = button(icon("reset"), `Reset ${name}`, () => set(control.default));
    const [label, about] = [id(), id()];
    this.#range.setAttribute("aria-labelledby", label);
    this.#range.setAttribute("aria-describedby", about);
    this.#number.setAttribute("aria-label", `${name} in ${control.unit || "numbers"}`);
    this.#fault.id = id();
    this.#range.addEventListener("input", () => set(this.#snapped()));
    this.#number.addEventListener("change", () => this.#typed());
    const head = el(
      "div",
      { class: "head" },
      el("span", { class: "name", id: label }, name),
      this.#mark,
      el("span", { class: "typed" }, this.#number, el("span", { class: "unit" }, control.unit)),
      this.#reset,
    );
    this.element = el(
      "div",
      { class: "control", "data-control": control.name },
      head,
      el("div", { class: "track" }, ticks(control, examples), this.#range),
      this.#fault,
      this.#given,
      el("p", { class: "about", id: about }, about_(control)),
    );
    this.show(control.default);
  }

  show(value: number): void {
    this.#value = value;
    const { minimum, maximum, unit } = this.#control;
    const outside = value < minimum || value > maximum;
    this.#range.value = String(Math.round(STEPS * share(this.#control, value)));
    this.#range.setAttribute(
      "aria-valuetext",
      `${this.#text()} ${unit}${outside ? ", outside what was sampled" : ""}`,
    );
    if (document.activeElement !== this.#number) this.#number.value = this.#text();
    this.element.toggleAttribute("data-outside", outside);
    this.#mark.textContent = outside ? "outside" : "";
    this.#reset.disabled = value === this.#control.default;
    this.#refuse("");
  }

  /** What the motion has of it, where that is not what was asked; null where it is. */
  tell(found: Deviation | null): void {
    const { minimum, maximum, unit } = this.#control;
    const value = found && written.short(found.given, maximum - minimum);
    this.#given.textContent = found ? `Given ${value} ${unit}: ${found.side} what was asked.` : "";
  }

  /** Where the slider stands; at a sampled value, where those are few. */
  #snapped(): number {
    const { minimum, maximum, values } = this.#control;
    const [least, most] = ends(this.#control);
    const value = least + (Number(this.#range.value) / STEPS) * (most - least);
    const free = Number(value.toPrecision(5));
    if (!values.length || value < minimum || value > maximum) return free;
    return values.reduce((best, each) =>
      Math.abs(each - value) < Math.abs(best - value) ? each : best,
    );
  }

  #typed(): void {
    const found = written.read(this.#number.value);
    this.#refuse(typeof found === "string" ? found : "");
    if (typeof found === "string") return;
    this.#set(found);
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

/** `target_height` as people write it. */
export function title(name: string): string {
  const words = name.replaceAll("_", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

function about_({ description, minimum, maximum, unit }: Control): string {
  const range = maximum - minimum;
  const sampled = `${written.short(minimum, range)} to ${written.short(maximum, range)} ${unit}`;
  return `${description ? `${description}. ` : ""}Sampled ${sampled}`;
}

function ends({ minimum, maximum }: Control): readonly [number, number] {
  const beyond = BEYOND * (maximum - minimum || 1);
  return [minimum - beyond, maximum + beyond];
}

function share(control: Control, value: number): number {
  const [least, most] = ends(control);
  return Math.min(1, Math.max(0, (value - least) / (most - least)));
}

/** The sampled range as a band and each example as a line in it. */
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
