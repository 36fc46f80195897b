/** Numbers as `posefield probe` writes them. */

/** With so many digits at most, without trailing zeros. */
export function general(value: number, digits: number): string {
  if (value === 0 || !Number.isFinite(value)) return String(value);
  const power = Number(value.toExponential(digits - 1).split("e")[1]);
  if (power >= -4 && power < digits) return String(Number(value.toPrecision(digits)));
  const [head, tail] = value.toExponential(digits - 1).split("e") as [string, string];
  const sign = tail.startsWith("-") ? "-" : "+";
  return `${Number(head)}e${sign}${tail.replace(/[+-]/, "").padStart(2, "0")}`;
}

/** A number with a fraction, `1.0` too. */
export function plain(value: number): string {
  return Number.isInteger(value) ? value.toFixed(1) : String(value);
}

export function median(values: readonly number[]): number {
  const sorted = values.toSorted((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle]! : (sorted[middle - 1]! + sorted[middle]!) / 2;
}

export function mean(values: readonly number[]): number {
  return values.reduce((sum, each) => sum + each, 0) / values.length;
}
