/** What the parts of this page share beyond what every part is given. */

import type { ModelCard } from "@posefield/client";

import type { Page } from "./page.ts";
import type { Player } from "./player.ts";

export interface Session extends Page {
  readonly player: Player;
}

/** The joint that a reach is for, and when in the clip it gets there, as a share of its duration. */
export type CardEvent = NonNullable<ModelCard["event"]>;
