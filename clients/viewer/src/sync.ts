/** The address bar and the state: each change is written when it has come to rest. */

import type { ModelCard } from "@posefield/client";

import * as hash from "./hash.ts";
import type { State, Store } from "./state.ts";

/** Milliseconds without a change until it is written. */
const REST = 350;
/** What is not worth a step back. */
const PASSING: ReadonlySet<keyof State> = new Set(["time", "playing"]);

export function follow(store: Store, card: ModelCard, signal: AbortSignal): void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let lasting = false;
  const write = () => {
    const text = hash.written(resting(store.state), card);
    if (text !== location.hash) {
      if (lasting) history.pushState(null, "", text);
      else history.replaceState(null, "", text);
    }
    lasting = false;
  };
  const leave = store.listen((state, changed) => {
    if (changed.size === 1 && changed.has("time") && state.playing) return;
    lasting ||= [...changed].some((key) => !PASSING.has(key));
    clearTimeout(timer);
    timer = setTimeout(write, REST);
  });
  write();
  signal.addEventListener("abort", () => {
    clearTimeout(timer);
    leave();
  });
}

/** What plays has no time worth keeping. */
export function resting(state: State): State {
  return state.playing ? { ...state, time: 0 } : state;
}
