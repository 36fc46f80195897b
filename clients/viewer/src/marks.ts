/** Whether anything like an answer was captured, and whether who moves was: a sign and words each. */

import type { Trust } from "@posefield/client";

import { el, icon } from "./dom.ts";

export interface Mark {
  readonly of: "support" | "performer";
  readonly held: boolean;
  readonly words: string;
}

type Told = Pick<Trust, "supported" | "performer_seen" | "performer">;

/** What the service says of the two; of what an older one does not say there is no mark. */
export function marks({ supported, performer_seen: seen, performer }: Told): Mark[] {
  const found: Mark[] = [];
  if (supported !== undefined) {
    const words = supported ? "Captured near here" : "Nothing like it was captured";
    found.push({ of: "support", held: supported, words });
  }
  if (seen !== undefined) {
    const words = seen
      ? `${performer ?? "The performer"} was captured`
      : "Moves as an unseen performer";
    found.push({ of: "performer", held: seen, words });
  }
  return found;
}

const SIGNS = {
  support: ["held", "gap"],
  performer: ["somebody", "nobody"],
} as const;

/** The same for a list; signs differ in shape, for those who tell no colours apart. */
export function items(trust: Told): HTMLElement[] {
  return marks(trust).map(({ of, held, words }) => {
    const sign = icon(SIGNS[of][held ? 0 : 1]);
    return el("li", { "data-mark": of, "data-held": held ? "yes" : "no" }, sign, words);
  });
}
