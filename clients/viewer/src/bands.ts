/** The bands of sigma in words, on one scale for all models; the service says which it is. */

/** End of the scale, m: bars are full from here on. */
export const SCALE = 0.2;

/** With the limits of the contract's `Band`. */
const WORDS: Readonly<Record<string, string>> = {
  close: "up to 3 cm",
  near: "3 to 7.5 cm",
  rough: "7.5 to 15 cm",
  guess: "more than 15 cm",
};

/** A band with its limits; a newer service may have others. */
export function worded(band: string): string {
  const limits = WORDS[band];
  return limits ? `${named(band)}: ${limits}` : band;
}

export function named(band: string): string {
  return band === "guess" ? "a guess" : band;
}
