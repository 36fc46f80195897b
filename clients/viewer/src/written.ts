/** Numbers as people write them. */

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

/** A number, or in words what is wrong with it. */
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

/** With as many digits as its range makes worth reading. */
export function short(value: number, range: number): string {
  const digits = Math.max(0, Math.min(4, Math.ceil(2 - Math.log10(range || 1))));
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}

/** A length in centimetres, with a digit after the point where that is worth reading. */
export function centimetres(metres: number): string {
  const found = 100 * metres;
  return `${found.toFixed(Math.abs(found) < 10 ? 1 : 0)} cm`;
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
