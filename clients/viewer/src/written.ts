/** Numbers and names as people write them. */

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

/** Return the number, or a sentence that says what is wrong with the text. */
export function read(text: string): number | string {
  const trimmed = text.trim().replace(/^−/, "-");
  if (!trimmed) return "Nothing is written here: a number is expected.";
  if (NUMBER.test(trimmed)) {
    const value = Number(trimmed);
    return Number.isFinite(value) ? value : `${trimmed} is too large.`;
  }
  if (/^[+-]?\d+,\d+$/.test(trimmed))
    return `${trimmed} is not a number here: write ${trimmed.replace(",", ".")}.`;
  return `“${trimmed}” is not a number.`;
}

/** Write a number with the digits that its range is worth. */
export function short(value: number, range: number): string {
  const digits = Math.max(0, Math.min(4, Math.ceil(2 - Math.log10(range || 1))));
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}

/** Write a length in centimetres, below 10 cm with one decimal. */
export function centimetres(metres: number): string {
  const value = 100 * metres;
  return `${value.toFixed(Math.abs(value) < 10 ? 1 : 0)} cm`;
}

export function seconds(value: number): string {
  return `${value.toFixed(2)} s`;
}

const SHORT = new Intl.NumberFormat("en", { maximumSignificantDigits: 3, useGrouping: false });
const WHOLE = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

/** Three digits of a number. */
export const figure = (value: number): string => SHORT.format(value).replace("-", "−");

/** A whole number with its thousands apart. */
export const whole = (value: number): string => WHOLE.format(value);

/** A length in centimetres to three digits, where one is compared with others. */
export const precise = (metres: number): string => `${figure(100 * metres)} cm`;

/** Write `target_height` as "Target height". */
export function title(name: string): string {
  const words = name.replaceAll("_", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}
