/** Shortcuts, where nobody is typing. */

import { served } from "./page.ts";
import type { Session } from "./session.ts";
import { nextSeed, whyFeetCannotStand } from "./takes.ts";
import * as theme from "./theme.ts";
import { move, togglePlay } from "./transport.ts";

export function mount(session: Session): void {
  const { card, player, signal, source, store } = session;
  const flip = (key: "loop" | "ghost" | "feet" | "fan" | "stands") => () =>
    store.set({ [key]: !store.state[key] });
  const acts: Readonly<Record<string, (event: KeyboardEvent) => void>> = {
    " ": () => togglePlay(session),
    arrowleft: ({ shiftKey }) => move(session, shiftKey ? -10 : -1),
    arrowright: ({ shiftKey }) => move(session, shiftKey ? 10 : 1),
    home: () => store.set({ playing: false, time: 0 }),
    end: () => store.set({ playing: false, time: player.duration }),
    r: () => store.set({ controls: defaults(card.controls) }),
    l: flip("loop"),
    g: flip("ghost"),
    f: flip("feet"),
    ...(served(source) && {
      n: () => store.set({ take: nextSeed(store.state.take) }),
      p: () => store.set({ take: 0 }),
      v: flip("fan"),
      ...(!whyFeetCannotStand(card) && { s: flip("stands") }),
    }),
    b: () => store.set({ body: store.state.body === "stick" ? "mannequin" : "stick" }),
    t: theme.toggle,
  };
  const press = (event: KeyboardEvent) => {
    const key = event.key.toLowerCase();
    const act = acts[key];
    // A performance has keys of its own.
    if (store.state.view === "performance") return;
    if (!act || event.ctrlKey || event.metaKey || event.altKey || taken(event.target, key)) return;
    event.preventDefault();
    act(event);
  };
  document.addEventListener("keydown", press, { signal });
}

function defaults(controls: Session["card"]["controls"]): Record<string, number> {
  return Object.fromEntries(controls.map((control) => [control.name, control.default]));
}

/** Whether the element that has the focus does something with the key itself. */
export function taken(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement) || target.closest("dialog")) return true;
  if (target instanceof HTMLInputElement) return target.type !== "range" || key.length > 1;
  if (target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement) return true;
  return key === " " && target.closest("button, a, summary") !== null;
}
