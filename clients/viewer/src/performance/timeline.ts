/** A plan as a timeline: places of bars and marks in per cent of the whole, and their words. */

import { figure, precise, seconds } from "../written.ts";
import type { Report } from "./answers.ts";

export interface Span {
  /** Per cent of the whole duration. */
  readonly left: number;
  readonly width: number;
}

export interface Bar extends Span {
  readonly kind: string;
  readonly sign: string;
  /** Begins with the sign, for who hears it and says it. */
  readonly words: string;
}

export interface Mark {
  readonly segment: number;
  readonly left: number;
  readonly hard: boolean;
  readonly words: string;
}

export interface Lane {
  readonly joint: string;
  readonly stays: readonly Span[];
}

export function bars({ duration, segments }: Report): Bar[] {
  return segments.map(({ kind, model, begins, ends }, index) => {
    const name = kind === "hold" ? "" : plainName(model);
    const sign = `${index + 1} ${name || kind}`;
    const words = `${sign}${name ? `, ${kind}` : ""}: ${seconds(begins)} to ${seconds(ends)}`;
    return { kind, sign, words, ...span(begins, ends, duration) };
  });
}

export function marks({ duration, joins }: Report): Mark[] {
  return joins.map((join) => ({
    segment: join.segment,
    left: (100 * join.time) / duration,
    hard: join.hard,
    words: joinWords(join),
  }));
}

/** What is known of a join, in a sentence. */
export function joinWords({
  distance,
  blend,
  seconds: blended,
  peak,
  usual,
  hard,
}: Report["joins"][number]): string {
  const apart = `Join: poses ${precise(distance)} apart, blend ${blend} over ${seconds(blended)}, peak ${figure(peak)} m/s² (else up to ${figure(usual)}).`;
  return hard
    ? `Hard ${apart[0]!.toLowerCase()}${apart.slice(1)} Nothing like it was captured.`
    : apart;
}

/** When each foot stands; none for feet as predicted. */
export function lanes({ duration, feet }: Report): Lane[] {
  const found = new Map<string, Span[]>();
  for (const { joint, begin, end } of feet?.stances ?? []) {
    const stays = found.get(joint) ?? [];
    stays.push(span(begin, end, duration));
    found.set(joint, stays);
  }
  return [...found].map(([joint, stays]) => ({ joint, stays }));
}

/** A warning or a fault with the place in the script that it is about. */
export interface Note {
  readonly pointer: string;
  readonly words: string;
  readonly fault: boolean;
}

/** Index of the segment that a pointer leads into; null for other places. */
export function segmentOf(pointer: string): number | null {
  const found = /^\/?segments\/(\d+)(?:\/|$)/.exec(pointer);
  return found ? Number(found[1]) : null;
}

/** The rest of a pointer within its segment, such as "targets/0". */
export function within(pointer: string): string {
  return pointer.replace(/^\/?segments\/\d+\/?/, "");
}

/** Notes on a segment, each once; those of no segment that is there for `null`. */
export function notesOf(notes: readonly Note[], segment: number | null, count: number): Note[] {
  const found = notes.filter(({ pointer }) => {
    const index = segmentOf(pointer);
    return (index !== null && index < count ? index : null) === segment;
  });
  return found.filter(
    ({ pointer, words }, i) =>
      found.findIndex((other) => other.pointer === pointer && other.words === words) === i,
  );
}

/** Without the hash of its content. */
export function plainName(model: string): string {
  return model.split("@")[0]!;
}

function span(begin: number, end: number, duration: number): Span {
  const share = duration > 0 ? 100 / duration : 0;
  return { left: share * begin, width: share * (end - begin) };
}
