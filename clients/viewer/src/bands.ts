/** The bands of sigma, on one scale for all models: those of the contract's `Band`. */

/** Largest sigma of each band, m; beyond the last one an answer is a guess. */
const BANDS = [
  ["close", 0.03],
  ["near", 0.075],
  ["rough", 0.15],
] as const;

/** End of the scale, m: bars are full from here on. */
export const SCALE = 0.2;

export type Band = (typeof BANDS)[number][0] | "guess";

export function band(sigma: number): Band {
  return BANDS.find(([, most]) => sigma <= most)?.[0] ?? "guess";
}

const WORDS: Readonly<Record<Band, string>> = {
  close: "close: up to 3 cm",
  near: "near: 3 to 7.5 cm",
  rough: "rough: 7.5 to 15 cm",
  guess: "a guess: more than 15 cm",
};

/** A band in words, with its limits. */
export function worded(sigma: number): string {
  return WORDS[band(sigma)];
}
