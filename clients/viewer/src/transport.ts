/** Time: play, frame by frame, where in the clip, how fast, and again and again. */

import { button, el, icon, toggle } from "./dom.ts";
import { step } from "./playback.ts";
import type { Session } from "./session.ts";
import * as written from "./written.ts";

export function mount(host: HTMLElement, session: Session): void {
  const { card, player, signal, store } = session;
  const play = button(icon("play"), "Play (space)", () => togglePlay(session));
  play.classList.add("play");
  const back = button(icon("back"), "One frame back (left arrow)", () => move(session, -1));
  const forward = button(icon("forward"), "One frame forward (right arrow)", () =>
    move(session, 1),
  );
  const loop = toggle(icon("loop"), "Loop", (on) => store.set({ loop: on }));
  const scrubber = el("input", {
    type: "range",
    min: 0,
    max: 1,
    step: "any",
    "aria-label": "Time",
  });
  // No output: nobody wants to be told of each frame.
  const time = el("span", { class: "time" });
  scrubber.addEventListener("input", () =>
    store.set({ playing: false, time: Math.min(player.duration, Number(scrubber.value)) }),
  );
  const show = () => {
    const { state } = store;
    const label = state.playing ? "Pause (space)" : "Play (space)";
    if (play.title !== label) {
      play.title = label;
      play.setAttribute("aria-label", label);
      play.replaceChildren(icon(state.playing ? "pause" : "play"));
    }
    loop.set(state.loop);
    scrubber.max = String(player.duration);
    scrubber.value = String(state.time);
    const text = `${written.seconds(state.time)} / ${written.seconds(player.duration)}`;
    time.textContent = text;
    scrubber.setAttribute("aria-valuetext", text);
    scrubber.style.setProperty("--done", `${(100 * state.time) / player.duration}%`);
  };
  host.append(back, play, forward, scrubber, time, loop, pace(session));
  loop.dataset["cyclic"] = String(card.cyclic);
  show();
  player.onTrust(show);
  signal.addEventListener("abort", store.listen(show));
}

export function togglePlay({ player, store }: Session): void {
  const { playing, time, loop } = store.state;
  const ended = !playing && !loop && time >= player.duration;
  store.set({ playing: !playing, ...(ended ? { time: 0 } : {}) });
}

/** So many frames on, around the ends of what loops. */
export function move({ card, player, store }: Session, frames: number): void {
  const { duration } = player;
  const frame = player.clip ? step(player.clip) : 1 / card.rate;
  const to = (Math.round(store.state.time / frame) + frames) * frame;
  const around = to < -1e-9 ? duration : to > duration + 1e-9 ? 0 : to;
  store.set({ playing: false, time: Math.min(duration, Math.max(0, around)) });
}

/** How fast, as a slider and a number. */
function pace({ signal, store }: Session): HTMLElement {
  const range = el("input", { type: "range", min: 0.1, max: 2, step: 0.05, "aria-label": "Speed" });
  const text = el("span");
  range.addEventListener("input", () => store.set({ speed: Number(range.value) }));
  const show = () => {
    const { speed } = store.state;
    range.value = String(speed);
    text.textContent = `${speed.toFixed(2)}×`;
    range.setAttribute("aria-valuetext", `${speed.toFixed(2)} times`);
  };
  show();
  signal.addEventListener("abort", store.listen(show));
  return el("span", { class: "pace" }, range, text);
}
