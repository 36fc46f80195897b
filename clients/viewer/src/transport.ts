/** Time: play, single frames, position in the clip, speed and loop, by buttons and keys. */

import { button, el, icon, toggle } from "./dom.ts";
import { step } from "./playback.ts";
import type { Session } from "./player.ts";
import { nextSeed, whyFeetCannotStand } from "./questions.ts";
import * as theme from "./theme.ts";
import * as written from "./written.ts";

/** Time of a motion, and whether it plays. */
export interface Clock {
  readonly time: number;
  readonly duration: number;
  readonly playing: boolean;
  readonly loop: boolean;
}

/** A play button, a slider over the time, its text, and a loop button. */
export class TimeBar {
  readonly play: HTMLButtonElement;
  readonly scrubber: HTMLInputElement;
  readonly time = el("span", { class: "time" });
  readonly loop: ReturnType<typeof toggle>;

  constructor(
    label: string,
    play: () => void,
    seek: (time: number) => void,
    loop: (on: boolean) => void,
  ) {
    this.play = button(icon("play"), "Play (space)", play);
    this.play.classList.add("play");
    this.loop = toggle(icon("loop"), "Loop", loop);
    const range = { type: "range", min: 0, max: 1, step: "any", "aria-label": label };
    this.scrubber = el("input", range);
    this.scrubber.addEventListener("input", () => seek(Number(this.scrubber.value)));
  }

  show({ time, duration, playing, loop }: Clock): void {
    const label = playing ? "Pause (space)" : "Play (space)";
    if (this.play.title !== label) {
      this.play.title = label;
      this.play.setAttribute("aria-label", label);
      this.play.replaceChildren(icon(playing ? "pause" : "play"));
    }
    this.loop.set(loop);
    const text = `${written.seconds(time)} / ${written.seconds(duration)}`;
    this.time.textContent = text;
    this.scrubber.max = String(duration || 1);
    this.scrubber.value = String(time);
    this.scrubber.setAttribute("aria-valuetext", text);
  }
}

export function mount(host: HTMLElement, session: Session): void {
  const { card, player, signal, store } = session;
  const bar = new TimeBar(
    "Time",
    () => togglePlay(session),
    (time) => store.set({ playing: false, time: Math.min(player.duration, time) }),
    (loop) => store.set({ loop }),
  );
  bar.loop.dataset["cyclic"] = String(card.cyclic);
  const back = button(icon("back"), "One frame back (left arrow)", () => move(session, -1));
  const forward = button(icon("forward"), "One frame forward (right arrow)", () =>
    move(session, 1),
  );
  const speed = el("input", { type: "range", min: 0.1, max: 2, step: 0.05, "aria-label": "Speed" });
  const factor = el("span");
  speed.addEventListener("input", () => store.set({ speed: Number(speed.value) }));
  host.append(back, bar.play, forward, bar.scrubber, bar.time, bar.loop);
  host.append(el("span", { class: "field pace" }, speed, factor));
  const show = () => {
    const { state } = store;
    bar.show({ ...state, duration: player.duration });
    speed.value = String(state.speed);
    factor.textContent = `${state.speed.toFixed(2)}×`;
    speed.setAttribute("aria-valuetext", `${state.speed.toFixed(2)} times`);
  };
  player.onTrust(show);
  store.follow(show, signal);
  listenToKeys(session);
}

function togglePlay({ player, store }: Session): void {
  const { playing, time, loop } = store.state;
  const ended = !playing && !loop && time >= player.duration;
  store.set({ playing: !playing, ...(ended ? { time: 0 } : {}) });
}

/** Step some frames, around the ends. */
function move({ card, player, store }: Session, frames: number): void {
  const { duration } = player;
  const frame = player.clip ? step(player.clip) : 1 / card.rate;
  const to = (Math.round(store.state.time / frame) + frames) * frame;
  const around = to < -1e-9 ? duration : to > duration + 1e-9 ? 0 : to;
  store.set({ playing: false, time: Math.min(duration, Math.max(0, around)) });
}

function listenToKeys(session: Session): void {
  const { card, player, signal, store } = session;
  const flip = (key: "loop" | "ghost" | "feet" | "fan" | "stands") => () =>
    store.set({ [key]: !store.state[key] });
  const acts: Readonly<Record<string, (event: KeyboardEvent) => void>> = {
    " ": () => togglePlay(session),
    arrowleft: ({ shiftKey }) => move(session, shiftKey ? -10 : -1),
    arrowright: ({ shiftKey }) => move(session, shiftKey ? 10 : 1),
    home: () => store.set({ playing: false, time: 0 }),
    end: () => store.set({ playing: false, time: player.duration }),
    r: () => store.set({ controls: {} }),
    l: flip("loop"),
    g: flip("ghost"),
    f: flip("feet"),
    n: () => store.set({ take: nextSeed(store.state.take) }),
    p: () => store.set({ take: 0 }),
    v: flip("fan"),
    ...(!whyFeetCannotStand(card) && { s: flip("stands") }),
    b: () => store.set({ body: store.state.body === "stick" ? "mannequin" : "stick" }),
    t: theme.toggle,
  };
  // A performance has keys of its own.
  onKeys(acts, () => store.state.view !== "performance", signal);
}

/** Call the function of a pressed key, where no element uses the key itself. */
export function onKeys(
  acts: Readonly<Record<string, (event: KeyboardEvent) => void>>,
  active: () => boolean,
  signal: AbortSignal,
): void {
  const press = (event: KeyboardEvent) => {
    const key = event.key.toLowerCase();
    const act = acts[key];
    if (!act || !active() || event.ctrlKey || event.metaKey || event.altKey) return;
    if (taken(event.target, key)) return;
    event.preventDefault();
    act(event);
  };
  document.addEventListener("keydown", press, { signal });
}

/** Tell whether the focused element uses the key itself. */
function taken(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement) || target.closest("dialog")) return true;
  if (target instanceof HTMLInputElement) return target.type !== "range" || key.length > 1;
  if (target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement) return true;
  return key === " " && target.closest("button, a, summary") !== null;
}
