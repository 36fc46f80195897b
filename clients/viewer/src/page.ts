/** Everything that a part of the page is given; a part is a module with `mount(host, page)`. */

import type { ModelCard } from "@posefield/client";

import type { Character } from "./character.ts";
import type { Scene } from "./scene.ts";
import type { Service } from "./service.ts";
import type { Store } from "./state.ts";

export interface Page {
  readonly store: Store;
  readonly service: Service;
  /** Of the shown model; parts are mounted anew when another is chosen. */
  readonly card: ModelCard;
  readonly character: Character;
  readonly scene: Scene;
  /** Show a fault; null when requests succeed again. */
  readonly notice: (fault: unknown) => void;
  /** Aborted when the parts are removed; ends their listeners and requests. */
  readonly signal: AbortSignal;
}
