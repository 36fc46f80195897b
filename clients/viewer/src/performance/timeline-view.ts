/** The plan over time: a bar for each segment, joins, contacts of feet, and where one is. */

import { button, el, icon, toggle } from "../dom.ts";
import * as written from "../written.ts";
import type { Report } from "./answers.ts";
import type { Desk } from "./desk.ts";
import { rest, togglePlay } from "./showing.ts";
import { bars, lanes, marks, notesOf, type Span } from "./timeline.ts";

export function mount(host: HTMLElement, desk: Desk): void {
  const view = new TimelineView(host, desk);
  desk.listen((change) => {
    if (change === "time" || change === "shown") view.tell();
    else view.draw();
  });
  desk.session.signal.addEventListener(
    "abort",
    desk.session.store.listen((_, changed) => {
      if (changed.has("playing") || changed.has("loop")) view.tell();
    }),
  );
  view.draw();
}

class TimelineView {
  readonly #desk: Desk;
  readonly #play: HTMLButtonElement;
  readonly #loop: ReturnType<typeof toggle>;
  readonly #scrubber = el("input", {
    type: "range",
    min: 0,
    max: 1,
    step: "any",
    "aria-label": "Time in the performance",
  });
  readonly #time = el("span", { class: "clock" });
  readonly #bars = el("ol", { class: "bars", "aria-label": "Segments over time" });
  readonly #marks = el("div", { class: "joins", "aria-hidden": "true" });
  readonly #lanes = el("div", { class: "lanes", role: "img" });
  readonly #head = el("div", { class: "playhead", "aria-hidden": "true" });
  readonly #track = el("div", { class: "track-of-time" });
  #drawn: Report | null = null;

  constructor(host: HTMLElement, desk: Desk) {
    this.#desk = desk;
    const { store } = desk.session;
    this.#play = button(icon("play"), "Play (space)", () => togglePlay(desk));
    this.#play.classList.add("play");
    this.#loop = toggle(icon("loop"), "Loop (L)", (on) => store.set({ loop: on }));
    this.#scrubber.addEventListener("input", () => rest(desk, Number(this.#scrubber.value)));
    this.#track.append(this.#bars, this.#marks, this.#lanes, this.#head);
    host.append(
      el("div", { class: "performance-time" }, this.#play, this.#scrubber, this.#time, this.#loop),
      this.#track,
    );
  }

  draw(): void {
    const { report } = this.#desk;
    if (report !== this.#drawn && report) {
      this.#drawn = report;
      this.#segments(report);
      this.#marks.replaceChildren(
        ...marks(report).map(({ hard, left, words }) =>
          placed(el("i", { "data-hard": hard, title: words }), { left }),
        ),
      );
      // Plans know no contacts: those of the last motion stay until the next one comes.
      if (report === this.#desk.performed?.report) this.#contacts(report);
    }
    this.#track.toggleAttribute("data-refused", this.#desk.refused);
    this.#mark();
    this.tell();
  }

  tell(): void {
    const { duration, session, time } = this.#desk;
    const { loop, playing } = session.store.state;
    const label = playing ? "Pause (space)" : "Play (space)";
    if (this.#play.title !== label) {
      this.#play.title = label;
      this.#play.setAttribute("aria-label", label);
      this.#play.replaceChildren(icon(playing ? "pause" : "play"));
    }
    this.#loop.set(loop);
    const text = `${written.seconds(time)} / ${written.seconds(duration)}`;
    this.#scrubber.max = String(duration || 1);
    this.#scrubber.value = String(time);
    this.#scrubber.setAttribute("aria-valuetext", text);
    this.#time.textContent = text;
    this.#head.style.left = `${duration ? (100 * time) / duration : 0}%`;
  }

  #segments(report: Report): void {
    const made = bars(report).map(({ kind, sign, words, ...span }, index) => {
      const bar = button(sign, words, () => {
        this.#desk.select(index);
        rest(this.#desk, report.segments[index]!.begins);
      });
      bar.dataset["kind"] = kind;
      return placed(el("li", {}, bar), span);
    });
    this.#bars.replaceChildren(...made);
  }

  /** Which segment is chosen, and which have something to be said of them. */
  #mark(): void {
    const { notes, script, selected } = this.#desk;
    const count = script?.segments.length ?? 0;
    this.#bars.querySelectorAll("button").forEach((bar, index) => {
      const own = notesOf(notes, index, count);
      const state = own.some(({ fault }) => fault) ? "fault" : own.length ? "warning" : "";
      bar.dataset["notes"] = state;
      if (index === selected) bar.setAttribute("aria-current", "true");
      else bar.removeAttribute("aria-current");
    });
  }

  #contacts(report: Report): void {
    const found = lanes(report);
    const words = found
      .map(({ joint, stays }) => `${joint} stands ${stays.length} times`)
      .join(", ");
    this.#lanes.setAttribute("aria-label", words || "Contacts of feet: none planned");
    this.#lanes.replaceChildren(
      ...found.map(({ joint, stays }) =>
        el("div", { title: `${joint} stands` }, ...stays.map((span) => placed(el("i"), span))),
      ),
    );
  }
}

/** Set by hand: the page's policy lets no element bring a style of its own. */
function placed<Own extends HTMLElement>(element: Own, { left, width }: Partial<Span>): Own {
  element.style.left = `${(left ?? 0).toFixed(3)}%`;
  if (width !== undefined) element.style.width = `${width.toFixed(3)}%`;
  return element;
}
