/** Colours of the page's own, for what is drawn and not written. */

import * as theme from "./theme.ts";

/** The colour of a level of detail; those beyond the fourth share its colour. */
export function levelColour(level: number): string {
  return theme.colour(`--level-${Math.min(level, 3)}`);
}

// Viridis (van der Walt and Smith, 2015): even steps look even, to the colour-blind too.
const VIRIDIS = [
  0x440154, 0x482878, 0x3e4a89, 0x31688e, 0x26828e, 0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b,
  0xfde725,
] as const;

/** Red, green and blue, 0 to 255, at a share of the scale; written into `out` from a place on. */
export function viridis(share: number, out: Uint8ClampedArray | number[], at = 0): void {
  const place = Math.min(1, Math.max(0, share)) * (VIRIDIS.length - 1);
  const first = Math.min(VIRIDIS.length - 2, Math.floor(place));
  const [low, high] = [VIRIDIS[first]!, VIRIDIS[first + 1]!];
  for (let i = 0; i < 3; i++) {
    const shift = 16 - 8 * i;
    const [a, b] = [(low >> shift) & 255, (high >> shift) & 255];
    out[at + i] = a + (b - a) * (place - first);
  }
}
