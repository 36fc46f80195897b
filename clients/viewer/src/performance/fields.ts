/** Fields of a form that write into a script and follow it; each knows its place by a pointer. */

import { button, chooser, el, id, labelled } from "../dom.ts";
import * as written from "../written.ts";
import type { Curve } from "./script.ts";

/** Shows the value that the script has now. */
export type Show = () => void;

export interface Fields {
  readonly element: HTMLElement;
  readonly show: Show;
}

/** Where in its segment a field's value is, its word, and its unit if it has one. */
export interface Spot {
  readonly at: string;
  readonly word: string;
  readonly unit?: string;
  /** What an empty field means; without it a number has to be there. */
  readonly empty?: string;
}

export function number(
  spot: Spot,
  read: () => number | undefined,
  write: (value: number | undefined) => void,
): Fields {
  return typed(
    spot,
    () => textOf(read()),
    write,
    (text) => written.read(text),
  );
}

/** A number, or a curve such as `0:0.8, 4:1.4`. */
export function curve(
  spot: Spot,
  read: () => number | Curve | undefined,
  write: (value: number | Curve | undefined) => void,
): Fields {
  const now = () => {
    const value = read();
    return Array.isArray(value)
      ? (value as Curve).map((pair) => pair.join(":")).join(", ")
      : textOf(value as number);
  };
  return typed(spot, now, write, curved);
}

/** A number or a curve, or in words what is wrong with it. */
export function curved(text: string): number | Curve | string {
  if (!text.includes(":")) return written.read(text);
  const found: [number, number][] = [];
  for (const part of text.split(",")) {
    const [at, value] = part.split(/:(.*)/s).map((each) => written.read(each));
    if (typeof at === "string") return at;
    if (typeof value !== "number") return value ?? `“${part}” is no pair such as 4:1.2.`;
    found.push([at!, value]);
  }
  return found;
}

export function select(
  spot: Spot,
  options: readonly (readonly [string, string])[],
  read: () => string,
  write: (value: string) => void,
): Fields {
  const list = chooser(options, read(), write);
  list.dataset["at"] = spot.at;
  const show = () => {
    const value = read();
    // What the script has is shown, whether this service knows it or not.
    if (![...list.options].some((option) => option.value === value))
      list.append(el("option", { value }, value));
    list.value = value;
  };
  show();
  return { element: labelled(spot.word, list), show };
}

/** Numbers side by side, such as a place; all of them or none. */
export function place(
  spot: Spot,
  axes: readonly string[],
  read: () => readonly number[] | undefined,
  write: (value: number[] | undefined) => void,
): Fields {
  const now = () => read() ?? [];
  const fault = el("p", { class: "fault", role: "alert" });
  const inputs = axes.map((axis) => input(`${spot.word}, ${axis}`, spot.at));
  const show = () => {
    inputs.forEach((field, i) => {
      if (!waits(field)) field.value = textOf(now()[i]);
    });
  };
  const take = () => {
    const texts = inputs.map(({ value }) => value.trim());
    const none = texts.every((text) => !text) && spot.empty !== undefined;
    const found = texts.map(written.read);
    const wrong = none ? undefined : found.find((value) => typeof value === "string");
    fault.textContent = texts.some(Boolean) || !spot.empty ? (wrong ?? "") : "";
    for (const [i, field] of inputs.entries()) {
      field.placeholder = spot.empty && !i ? spot.empty : "";
      field.setAttribute("aria-invalid", String(!none && typeof found[i] === "string"));
    }
    if (!wrong) write(none ? undefined : (found as number[]));
  };
  for (const [i, field] of inputs.entries()) {
    field.placeholder = spot.empty && !i ? spot.empty : "";
    field.addEventListener("change", take);
  }
  show();
  const row = inputs.map((field, i) =>
    el("span", {}, el("span", { class: "unit", "aria-hidden": "true" }, axes[i]!), field),
  );
  const host = el(
    "div",
    {
      class: axes.length > 2 ? "field place wide" : "field place",
      role: "group",
      "aria-label": unitWords(spot),
    },
    el("span", { class: "word" }, unitWords(spot)),
    el("div", { class: "axes" }, ...row),
    fault,
  );
  return { element: host, show };
}

/** A button with a sign that acts on what its words say. */
export function act(sign: string, words: string, at: string, done: () => void): HTMLButtonElement {
  const made = button(sign, words, done);
  made.dataset["at"] = at;
  return made;
}

/** Several fields as one. */
export function all(parts: readonly Fields[], host: HTMLElement): Fields {
  host.append(...parts.map(({ element }) => element));
  return {
    element: host,
    show: () => {
      for (const { show } of parts) show();
    },
  };
}

/** Folded away until it is opened. */
export function folded(words: string, parts: readonly Fields[]): Fields {
  const host = el("details", {}, el("summary", {}, words));
  return all(parts, host);
}

function typed<Value>(
  spot: Spot,
  now: () => string,
  write: (value: Value | undefined) => void,
  parse: (text: string) => Value | string,
): Fields {
  const field = input(null, spot.at);
  const fault = el("p", { class: "fault", role: "alert", id: id() });
  field.setAttribute("aria-describedby", fault.id);
  field.placeholder = spot.empty ?? "";
  const show = () => {
    if (!waits(field)) field.value = now();
  };
  field.addEventListener("change", () => {
    const none = !field.value.trim() && spot.empty !== undefined;
    const found = none ? undefined : parse(field.value);
    const wrong = typeof found === "string";
    field.setAttribute("aria-invalid", String(wrong));
    fault.textContent = wrong ? found : "";
    if (!wrong) write(found);
  });
  show();
  const host = labelled(unitWords(spot), field);
  host.append(fault);
  return { element: host, show };
}

function input(label: string | null, at: string): HTMLInputElement {
  return el("input", {
    type: "text",
    inputmode: "decimal",
    autocomplete: "off",
    "aria-label": label,
    "data-at": at,
  });
}

/** What was typed and is wrong stays until it is mended. */
function waits(field: HTMLInputElement): boolean {
  return field.getAttribute("aria-invalid") === "true" && field.dataset["told"] === undefined;
}

function unitWords({ word, unit }: Spot): string {
  return unit ? `${word}, ${unit}` : word;
}

function textOf(value: number | undefined): string {
  return typeof value === "number"
    ? String(Number(value.toFixed(4)))
    : value === undefined
      ? ""
      : String(value);
}
