/** Elements, made by hand; text is text, never markup. */

type Attributes = Readonly<Record<string, string | number | boolean | null>>;

/** `false` and `null` leave an attribute out, `true` writes it empty. */
export function el<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  attributes: Attributes = {},
  ...content: readonly (Node | string)[]
): HTMLElementTagNameMap[Tag] {
  const made = document.createElement(tag);
  assign(made, attributes);
  made.append(...content);
  return made;
}

export function svg<Tag extends keyof SVGElementTagNameMap>(
  tag: Tag,
  attributes: Attributes = {},
  ...content: readonly Node[]
): SVGElementTagNameMap[Tag] {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  assign(made, attributes);
  made.append(...content);
  return made;
}

function assign(made: Element, attributes: Attributes): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === false) continue;
    made.setAttribute(name, value === true ? "" : String(value));
  }
}

/** A button that says what it does; `label` is for those who do not see the sign on it. */
export function button(sign: string | Node, label: string, act: () => void): HTMLButtonElement {
  const made = el("button", { type: "button", "aria-label": label, title: label }, sign);
  made.addEventListener("click", act);
  return made;
}

/** A button that is in or out. */
export function toggle(
  sign: string | Node,
  label: string,
  act: (pressed: boolean) => void,
): HTMLButtonElement & { set(pressed: boolean): void } {
  const made = button(sign, label, () => act(made.getAttribute("aria-pressed") !== "true"));
  made.setAttribute("aria-pressed", "false");
  return Object.assign(made, {
    set: (pressed: boolean) => made.setAttribute("aria-pressed", String(pressed)),
  });
}

/** One of a few, as buttons in a row. */
export function choice<Value extends string>(
  label: string,
  values: readonly (readonly [Value, string])[],
  act: (value: Value) => void,
): HTMLElement & { set(value: Value): void } {
  const buttons = values.map(([value, name]) => {
    const made = el("button", { type: "button", "data-value": value }, name);
    made.addEventListener("click", () => act(value));
    return made;
  });
  const group = el("div", { class: "choice", role: "group", "aria-label": label }, ...buttons);
  return Object.assign(group, {
    set: (value: Value) => {
      for (const each of buttons)
        each.setAttribute("aria-pressed", String(each.dataset["value"] === value));
    },
  });
}

/** A word and the field that it names, for everybody; the word may change. */
export function labelled(word: string, field: HTMLElement): HTMLDivElement {
  field.id ||= id();
  return el("div", { class: "field" }, el("label", { for: field.id }, word), field);
}

/** A list to choose from; values and what they are called. */
export function chooser(
  options: readonly (readonly [string, string])[],
  chosen: string,
  taken: (value: string) => void,
): HTMLSelectElement {
  const made = el("select", {}, ...options.map(([value, name]) => el("option", { value }, name)));
  made.value = chosen;
  made.addEventListener("change", () => taken(made.value));
  return made;
}

let made = 0;

/** An id that nothing else on the page has. */
export function id(): string {
  return `e${made++}`;
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
