/** What every part of the page is given. A part is a module with `mount(host, page)`. */

import type { Client, Download, ModelCard } from "@posefield/client";

import type { Character } from "./character.ts";
import type { Scene } from "./scene.ts";
import type { Store } from "./state.ts";

/** Who answers: a service, or a table in the page itself (offline/), which leaves some things out. */
export type Source = Pick<
  Client,
  "models" | "card" | "pose" | "clip" | "crowd" | "sigma" | "why"
> & {
  character(model: string, signal?: AbortSignal): Promise<Pick<Download, "content">>;
  /** What is to be known of the answers. */
  readonly remark?: string;
  /** Label sets that all answers leave open. */
  readonly open?: readonly string[];
};

/** A service also gives files and says what an answer is made of; a table in the page does not. */
export function served(source: Source): source is Source & Pick<Client, "file" | "kernel"> {
  return "file" in source;
}

export interface Page {
  readonly store: Store;
  readonly source: Source;
  /** Of the model that is shown; parts are mounted anew when another is chosen. */
  readonly card: ModelCard;
  readonly character: Character;
  readonly scene: Scene;
  /** Says what happened and goes on; `null` when all is well again. */
  readonly notice: (fault: unknown) => void;
  /** Ends when the parts are taken away: listeners and questions hang on it. */
  readonly signal: AbortSignal;
}

export type Mount = (host: HTMLElement, page: Page) => void;
