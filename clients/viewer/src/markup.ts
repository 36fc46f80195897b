/** Elements in a line of code, and numbers as people write them. */

type Child = Node | string;
type Given<Tag extends keyof HTMLElementTagNameMap> = Partial<
  Omit<HTMLElementTagNameMap[Tag], "style" | "dataset" | "children">
>;

/** An element with its properties and what stands in it; text is never read as markup. */
export function element<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  given: Given<Tag> = {},
  ...children: readonly Child[]
): HTMLElementTagNameMap[Tag] {
  const made = Object.assign(document.createElement(tag), given);
  made.append(...children);
  return made;
}

let fields = 0;

/** A word and the field that it names, for everybody; the word may change. */
export function labelled(word: string, field: HTMLElement): HTMLDivElement {
  field.id ||= `field-${fields++}`;
  return element(
    "div",
    { className: "field" },
    element("label", { htmlFor: field.id }, word),
    field,
  );
}

/** A list to choose from; values and what they are called. */
export function chooser(
  options: readonly (readonly [string, string])[],
  chosen: string,
  taken: (value: string) => void,
): HTMLSelectElement {
  const made = element(
    "select",
    {},
    ...options.map(([value, name]) => element("option", { value }, name)),
  );
  made.value = chosen;
  made.addEventListener("change", () => taken(made.value));
  return made;
}

const SHORT = new Intl.NumberFormat("en", { maximumSignificantDigits: 3, useGrouping: false });
const WHOLE = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

/** Three digits of a number. */
export const figure = (value: number): string => SHORT.format(value).replace("-", "−");

/** A whole number with its thousands apart. */
export const whole = (value: number): string => WHOLE.format(value);

/** Metres as centimetres. */
export const centimetres = (metres: number): string => `${figure(100 * metres)} cm`;
