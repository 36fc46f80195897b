/** The performance over time: a bar for each segment, joins, contacts of feet, and the time. */

import type { PerformanceReport } from "@posefield/client";

import { button, el } from "../dom.ts";
import { TimeBar } from "../transport.ts";
import { figure, precise, seconds } from "../written.ts";
import type { Performance } from "./performance.ts";
import { type Note, segmentOf } from "./script.ts";
import { togglePlay } from "./stage.ts";

/** A part of the duration, in per cent. */
interface Span {
  readonly left: number;
  readonly width: number;
}

export function mount(host: HTMLElement, performance: Performance): void {
  const { signal, store } = performance.session;
  const bar = new TimeBar(
    "Time in the performance",
    () => togglePlay(performance),
    (time) => performance.rest(time),
    (loop) => store.set({ loop }),
  );
  const segments = el("ol", { class: "bars", "aria-label": "Segments over time" });
  const joins = el("div", { class: "joins", "aria-hidden": "true" });
  const contacts = el("div", { class: "lanes", role: "img" });
  const head = el("div", { class: "playhead", "aria-hidden": "true" });
  const track = el("div", { class: "track-of-time" }, segments, joins, contacts, head);
  host.append(
    el("div", { class: "performance-time" }, bar.play, bar.scrubber, bar.time, bar.loop),
    track,
  );
  const showTime = () => {
    const { duration, time } = performance;
    const { loop, playing } = store.state;
    bar.show({ time, duration, playing, loop });
    head.style.left = `${duration ? (100 * time) / duration : 0}%`;
  };
  const showReport = (report: PerformanceReport) => {
    segments.replaceChildren(
      ...bars(report).map(({ kind, name, words, ...span }, index) => {
        const element = button(name, words, () => performance.rest(report.segments[index]!.begins));
        element.dataset["kind"] = kind;
        const state = notesState(performance.notes, index);
        if (state) element.dataset["notes"] = state;
        return placed(el("li", {}, element), span);
      }),
    );
    joins.replaceChildren(
      ...report.joins.map((join) =>
        placed(el("i", { "data-hard": join.hard, title: joinWords(join) }), {
          left: (100 * join.time) / report.duration,
        }),
      ),
    );
    const feet = lanes(report);
    const words = feet.map(({ joint, spans }) => `${joint} stands ${spans.length} times`);
    contacts.setAttribute("aria-label", words.join(", ") || "Contacts of feet: none planned");
    contacts.replaceChildren(
      ...feet.map(({ joint, spans }) =>
        el("div", { title: `${joint} stands` }, ...spans.map((span) => placed(el("i"), span))),
      ),
    );
  };
  performance.listen((change) => {
    if (change === "answer" && !performance.busy) {
      track.toggleAttribute("data-refused", performance.refused);
      if (performance.report) showReport(performance.report);
    }
    showTime();
  });
  store.follow(showTime, signal);
}

/** Return the bars of the segments, whose words begin with the visible name. */
export function bars({ duration, segments }: PerformanceReport) {
  return segments.map(({ kind, model, begins, ends }, index) => {
    const short = kind === "hold" ? "" : model.split("@")[0]!;
    const name = `${index + 1} ${short || kind}`;
    const words = `${name}${short ? `, ${kind}` : ""}: ${seconds(begins)} to ${seconds(ends)}`;
    return { kind, name, words, ...spanOf(begins, ends, duration) };
  });
}

/** Say how hard a join is. */
export function joinWords(join: PerformanceReport["joins"][number]): string {
  const { distance, blend, peak, usual, hard } = join;
  const text = `oin: poses ${precise(distance)} apart, blend ${blend} over ${seconds(join.seconds)}, peak ${figure(peak)} m/s² (else up to ${figure(usual)}).`;
  return hard ? `Hard j${text} Nothing like it was captured.` : `J${text}`;
}

/** Return when each foot stands; empty for feet as predicted. */
export function lanes({ duration, feet }: PerformanceReport) {
  const feetSpans = new Map<string, Span[]>();
  for (const { joint, begin, end } of feet?.stances ?? []) {
    const spans = feetSpans.get(joint) ?? [];
    spans.push(spanOf(begin, end, duration));
    feetSpans.set(joint, spans);
  }
  return [...feetSpans].map(([joint, spans]) => ({ joint, spans }));
}

function spanOf(begin: number, end: number, duration: number): Span {
  const share = duration > 0 ? 100 / duration : 0;
  return { left: share * begin, width: share * (end - begin) };
}

function notesState(notes: readonly Note[], segment: number): "fault" | "warning" | null {
  const about = notes.filter(({ pointer }) => segmentOf(pointer) === segment);
  if (!about.length) return null;
  return about.some(({ fault }) => fault) ? "fault" : "warning";
}

/** Place an element; the page's policy allows no style attribute in markup. */
function placed<Kind extends HTMLElement>(element: Kind, { left, width }: Partial<Span>): Kind {
  element.style.left = `${(left ?? 0).toFixed(3)}%`;
  if (width !== undefined) element.style.width = `${width.toFixed(3)}%`;
  return element;
}
