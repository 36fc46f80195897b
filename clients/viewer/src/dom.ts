/** Elements, files to save, and values that the browser keeps. Text is inserted as text, never as markup. */

type Attributes = Readonly<Record<string, string | number | boolean | null>>;

/** `false` and `null` leave an attribute out, `true` writes it empty. */
export function el<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  attributes: Attributes = {},
  ...content: readonly (Node | string)[]
): HTMLElementTagNameMap[Tag] {
  return assign(document.createElement(tag), attributes, content);
}

export function svg<Tag extends keyof SVGElementTagNameMap>(
  tag: Tag,
  attributes: Attributes = {},
  ...content: readonly Node[]
): SVGElementTagNameMap[Tag] {
  return assign(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, content);
}

function assign<Kind extends Element>(
  element: Kind,
  attributes: Attributes,
  content: readonly (Node | string)[],
): Kind {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === false) continue;
    element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...content);
  return element;
}

/** A button; `label` names it for tooltips and screen readers. */
export function button(sign: string | Node, label: string, act: () => void): HTMLButtonElement {
  const element = el("button", { type: "button", "aria-label": label, title: label }, sign);
  element.addEventListener("click", act);
  return element;
}

/** A button with its text as its name. */
export function textButton(text: string, act: () => void, classes = ""): HTMLButtonElement {
  const element = el("button", { type: "button", class: classes || null }, text);
  element.addEventListener("click", act);
  return element;
}

/** A button with two states. */
export function toggle(
  sign: string | Node,
  label: string,
  act: (pressed: boolean) => void,
): HTMLButtonElement & { set(pressed: boolean): void } {
  const element = button(sign, label, () => act(element.getAttribute("aria-pressed") !== "true"));
  element.setAttribute("aria-pressed", "false");
  return Object.assign(element, {
    set: (pressed: boolean) => element.setAttribute("aria-pressed", String(pressed)),
  });
}

/** A choice among few values, as buttons in a row. */
export function choice<Value extends string>(
  label: string,
  values: readonly (readonly [Value, string])[],
  act: (value: Value) => void,
): HTMLElement & { set(value: Value): void } {
  const buttons = values.map(([value, name]) => {
    const element = textButton(name, () => act(value));
    element.dataset["value"] = value;
    return element;
  });
  const group = el("div", { class: "choice", role: "group", "aria-label": label }, ...buttons);
  return Object.assign(group, {
    set: (value: Value) => {
      for (const element of buttons)
        element.setAttribute("aria-pressed", String(element.dataset["value"] === value));
    },
  });
}

/** A field with its label. */
export function labelled(word: string, field: HTMLElement): HTMLDivElement {
  field.id ||= id();
  return el("div", { class: "field" }, el("label", { for: field.id }, word), field);
}

/** A field for a number; others than those of the range are not taken, nor fractions for step 1. */
export function numberField(
  word: string,
  range: Readonly<Record<"min" | "max" | "step", number>>,
  take: (value: number) => void,
): HTMLElement & { set(value: number): void } {
  const field = el("input", { type: "number", ...range });
  let shown = 0;
  field.addEventListener("change", () => {
    const { rangeOverflow, rangeUnderflow, stepMismatch } = field.validity;
    const wrong = rangeOverflow || rangeUnderflow || (range.step === 1 && stepMismatch);
    if (field.value && !wrong) take(field.valueAsNumber);
    else field.value = String(shown);
  });
  const set = (value: number) => {
    shown = value;
    if (field.valueAsNumber !== value) field.value = String(value);
  };
  return Object.assign(labelled(word, field), { set });
}

/** A list to choose from: values and their names. */
export function chooser(
  options: readonly (readonly [string, string])[],
  chosen: string,
  take: (value: string) => void,
): HTMLSelectElement {
  const list = el("select", {}, ...options.map(([value, name]) => el("option", { value }, name)));
  list.value = chosen;
  list.addEventListener("change", () => take(list.value));
  return list;
}

/** A checkbox with its text. */
export function checkbox(
  text: string,
  take: (checked: boolean) => void,
): HTMLElement & { set(checked: boolean): void } {
  const box = el("input", { type: "checkbox" });
  box.addEventListener("change", () => take(box.checked));
  return Object.assign(el("label", { class: "check" }, box, el("span", {}, text)), {
    set: (checked: boolean) => {
      box.checked = checked;
    },
  });
}

/** A heading with something beside it. */
export function titled(title: string, beside: Node): HTMLElement {
  return el("div", { class: "title" }, el("h2", {}, title), beside);
}

let ids = 0;

/** An id that no other element of the page has. */
export function id(): string {
  return `e${ids++}`;
}

/** Let the browser save content as a file. */
export function saveFile(name: string, content: Blob): void {
  const address = URL.createObjectURL(content);
  el("a", { href: address, download: name }).click();
  // The browser has read it by then.
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** Return a value that the browser keeps; null without one, or where it keeps none. */
export function recall(kind: "localStorage" | "sessionStorage", name: string): string | null {
  try {
    return globalThis[kind].getItem(name);
  } catch {
    return null;
  }
}

/** Let the browser keep a value, where it keeps any. */
export function remember(
  kind: "localStorage" | "sessionStorage",
  name: string,
  value: string,
): void {
  try {
    globalThis[kind].setItem(name, value);
  } catch {
    // The value then holds until the page is closed.
  }
}

const ICONS = {
  play: "M5 3.5v13l11-6.5z",
  pause: "M5 3.5h3.5v13H5zM11.5 3.5H15v13h-3.5z",
  back: "M4 4h2v12H4zM16 4v12l-9-6z",
  forward: "M14 4h2v12h-2zM4 4v12l9-6z",
  reset: "M10 4a6 6 0 1 1-5.6 3.9l1.9.7A4 4 0 1 0 10 6v3L5.5 5 10 1z",
  loop: "M6 5h7a4 4 0 0 1 4 4h-2a2 2 0 0 0-2-2H6v2.5L2.5 6 6 2.5zM14 15H7a4 4 0 0 1-4-4h2a2 2 0 0 0 2 2h7v-2.5l3.5 3.5-3.5 3.5z",
  held: "M10 2a8 8 0 1 1 0 16 8 8 0 0 1 0-16zM5.4 10.4l3.5 3.5 5.9-6.1-1.4-1.4-4.5 4.7L6.8 9z",
  gap: "M2 2h16v16H2zM3.6 3.6v12.8h12.8V3.6zM3.6 7.4l3.8-3.8h2L3.6 9.4zM3.6 15.4 15.4 3.6h1v1L4.6 16.4h-1zM10.6 16.4l5.8-5.8v2l-3.8 3.8z",
  somebody: "M10 2.5a3.6 3.6 0 1 1 0 7.2 3.6 3.6 0 0 1 0-7.2zM3 17.5c0-4 3-6.3 7-6.3s7 2.3 7 6.3z",
  nobody:
    "M10 2.5a3.6 3.6 0 1 1 0 7.2 3.6 3.6 0 0 1 0-7.2zM10 3.9a2.2 2.2 0 1 0 0 4.4 2.2 2.2 0 0 0 0-4.4zM3 17.5c0-4 3-6.3 7-6.3s7 2.3 7 6.3zM15.3 16c-.5-2.2-2.5-3.4-5.3-3.4S5.2 13.8 4.7 16z",
  light:
    "M10 6.2a3.8 3.8 0 1 1 0 7.6 3.8 3.8 0 0 1 0-7.6zM9.2 1h1.6v3H9.2zM9.2 16h1.6v3H9.2zM1 9.2h3v1.6H1zM16 9.2h3v1.6h-3zM3.1 4.2l1.1-1.1 2.1 2.1-1.1 1.1zM13.7 14.8l1.1-1.1 2.1 2.1-1.1 1.1zM3.1 15.8l2.1-2.1 1.1 1.1-2.1 2.1zM13.7 5.2l2.1-2.1 1.1 1.1-2.1 2.1z",
} as const;

export function icon(name: keyof typeof ICONS): SVGSVGElement {
  const shape = svg("path", { d: ICONS[name] });
  return svg("svg", { viewBox: "0 0 20 20", "aria-hidden": "true", class: "icon" }, shape);
}
