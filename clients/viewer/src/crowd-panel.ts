/** What the crowd is asked to be, and what it costs: sliders, counts and times. */

import { TAKES } from "./crowd-library.ts";
import { el, labelled, toggle } from "./dom.ts";
import { type Page, served } from "./page.ts";
import type { State } from "./state.ts";
import { figure } from "./written.ts";

const [FEWEST, MOST] = [50, 10_000];
/** Powers of two between which the limit in pixels lies. */
const [SHARP, COARSE] = [-2, 4];

export class Panel {
  readonly #host = el("section", { class: "crowd", hidden: true, "aria-label": "Crowd" });
  readonly #said = el("p", { class: "crowd-said" });
  readonly #time = el("p", { class: "crowd-time" });
  readonly #seen = el("p", { class: "crowd-time" });
  readonly #progress = el("progress", { max: 1, hidden: true, "aria-label": "Motions computed" });
  readonly #counts: readonly HTMLElement[];

  constructor(host: HTMLElement, page: Page) {
    this.#counts = page.card.levels.map(() => el("b", {}, "–"));
    const levels = page.card.levels.map((_, level) =>
      el("li", { class: `crowd-${Math.min(level, 3)}` }, `level ${level}`, this.#counts[level]!),
    );
    const walks = page.card.cyclic && page.card.root === "travelling";
    const what = walks
      ? "Characters walk along straight or gently curved paths, and re-enter on the opposite side."
      : "This model does not walk: each character stays in place and repeats a captured motion forwards and backwards.";
    this.#host.append(
      el("h2", {}, "Crowd"),
      el("p", { class: "crowd-said" }, what),
      this.#said,
      this.#progress,
      people(page),
      takes(page),
      limit(page),
      el("ul", {}, ...levels),
      this.#seen,
      this.#time,
    );
    host.append(this.#host);
    page.signal.addEventListener("abort", () => this.#host.remove());
  }

  show(shown: boolean): void {
    this.#host.hidden = !shown;
  }

  say(text: string): void {
    this.#said.textContent = text;
  }

  /** Share of the motions that is there; null where none are waited for. */
  progress(share: number | null): void {
    this.#progress.hidden = share === null;
    this.#progress.value = share ?? 0;
  }

  count(counts: Int32Array, seen: number): void {
    this.#counts.forEach((host, level) => {
      host.textContent = String(counts[level]);
    });
    this.#seen.textContent = `${seen} in view`;
  }

  /** Milliseconds from a frame to the next, and those of them that this page's own work takes. */
  time(frame: number, own: number): void {
    this.#host.dataset["frame"] = frame.toFixed(2);
    this.#host.dataset["own"] = own.toFixed(2);
    this.#time.textContent = `${figure(frame)} ms a frame (${Math.round(1000 / frame)} a second); moving all: ${own.toFixed(1)} ms`;
  }
}

function people(page: Page): HTMLElement {
  const range = { min: FEWEST, max: MOST, step: 50 };
  const said = (value: number) => `${value.toLocaleString("en")} characters`;
  return slider(page, "crowd", range, said, Number, (count) => count);
}

/** Whether the motions are takes; only a service has them. */
function takes({ signal, source, store }: Page): HTMLElement {
  const label = `No two alike: ${TAKES} motions instead of a few, each a take of its own`;
  const own = toggle("No two alike", label, (on) => store.set({ varied: on }));
  own.hidden = !served(source);
  const show = () => own.set(store.state.varied);
  show();
  signal.addEventListener("abort", store.listen(show));
  return own;
}

function limit(page: Page): HTMLElement {
  const range = { min: SHARP, max: COARSE, step: 0.25 };
  const said = (value: number) => `errors up to ${figure(value)} px`;
  return slider(
    page,
    "pixels",
    range,
    said,
    (place) => Number((2 ** place).toPrecision(3)),
    Math.log2,
  );
}

/** A slider of one of the state's numbers, with its value in words. */
function slider(
  page: Page,
  key: "crowd" | "pixels",
  range: { min: number; max: number; step: number },
  said: (value: number) => string,
  valued: (place: number) => number,
  placed: (value: number) => number,
): HTMLElement {
  const input = el("input", { type: "range" });
  Object.assign(input, {
    min: String(range.min),
    max: String(range.max),
    step: String(range.step),
  });
  const host = labelled("", input);
  const show = (state: State) => {
    input.value = String(placed(state[key]));
    host.firstElementChild!.textContent = said(state[key]);
    input.setAttribute("aria-valuetext", said(state[key]));
  };
  input.addEventListener("input", () => page.store.set({ [key]: valued(Number(input.value)) }));
  page.signal.addEventListener("abort", page.store.listen(show));
  show(page.store.state);
  return host;
}
