/** The script of a performance as text: its form, places in it, and notes on them. */

import type { PerformanceQuestion } from "@posefield/client";
import { Problem, WrongQuestion } from "@posefield/client";

/** Characters of a script that still goes into a link. */
export const LONGEST_SCRIPT = 20_000;

/** A warning or a fault, and the JSON pointer of its place in the script. */
export interface Note {
  readonly pointer: string;
  readonly words: string;
  readonly fault: boolean;
}

const KINDS: ReadonlySet<unknown> = new Set(["walk", "act", "hold"]);

/** Return a script as far as the page reads it, or what is wrong; the service checks the rest. */
export function read(text: string): PerformanceQuestion | string {
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch (fault) {
    return `This is not JSON: ${(fault as Error).message}.`;
  }
  const segments = isObject(value) ? value["segments"] : undefined;
  if (!Array.isArray(segments) || !segments.length)
    return 'A script is an object with "segments", a list of one segment or more.';
  const wrong = segments.findIndex((segment) => !isObject(segment) || !KINDS.has(segment["kind"]));
  if (wrong >= 0) return `/segments/${wrong}: expected an object with "kind": walk, act or hold.`;
  return value as PerformanceQuestion;
}

/** Write a script with a line for each segment and each other field. */
export function pretty(script: PerformanceQuestion): string {
  const fields = Object.entries(script).map(([name, value]) => {
    const lines =
      name === "segments" ? (value as unknown[]).map((each) => `    ${spaced(each)}`) : [];
    const text = lines.length ? `[\n${lines.join(",\n")}\n  ]` : spaced(value);
    return `  ${JSON.stringify(name)}: ${text}`;
  });
  return `{\n${fields.join(",\n")}\n}\n`;
}

function spaced(value: unknown): string {
  if (Array.isArray(value)) return `[${value.map(spaced).join(", ")}]`;
  if (!isObject(value)) return JSON.stringify(value);
  const fields = Object.entries(value).map(
    ([name, field]) => `${JSON.stringify(name)}: ${spaced(field)}`,
  );
  return `{${fields.join(", ")}}`;
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** Return the first and last offset of the value at a JSON pointer in valid JSON.
 *
 * Of a value that is missing, the place of the nearest value around it.
 */
export function spanOf(text: string, pointer: string): readonly [number, number] {
  const path = pointer
    .split("/")
    .filter(Boolean)
    .map((key) => key.replaceAll("~1", "/").replaceAll("~0", "~"));
  const tokens = [...text.matchAll(/"(?:[^"\\]|\\.)*"|[{}[\]:,]|[^\s{}[\]:,"]+/g)];
  let best: { depth: number; span: readonly [number, number] } = {
    depth: -1,
    span: [0, text.length],
  };
  let next = 0;
  /** Walk over a value; matched: leading keys of the path that lead to it, -1 for another path. */
  const walk = (matched: number): void => {
    const start = tokens[next]!;
    const [open] = start;
    next++;
    if (open === "{" || open === "[") {
      const close = open === "{" ? "}" : "]";
      for (let index = 0; tokens[next]![0] !== close; index++) {
        let key = String(index);
        if (open === "{") {
          key = JSON.parse(tokens[next]![0]) as string;
          next += 2;
        }
        walk(matched >= 0 && path[matched] === key ? matched + 1 : -1);
        if (tokens[next]![0] === ",") next++;
      }
      next++;
    }
    const last = tokens[next - 1]!;
    if (matched > best.depth)
      best = { depth: matched, span: [start.index, last.index + last[0].length] };
  };
  walk(0);
  return best.span;
}

/** Return the number of the line of an offset. */
export function lineOf(text: string, offset: number): number {
  return text.slice(0, offset).split("\n").length;
}

/** Return the index of the segment that a pointer leads into; null for other places. */
export function segmentOf(pointer: string): number | null {
  const match = /^\/?segments\/(\d+)(?:\/|$)/.exec(pointer);
  return match ? Number(match[1]) : null;
}

/** Return the faults of a script with their places; null for a fault that is not the script's. */
export function faultsOf(fault: unknown): readonly Note[] | null {
  if (fault instanceof WrongQuestion) {
    const segment = /segment (\d+)/.exec(fault.message);
    const pointer = segment ? `/segments/${segment[1]}` : "";
    return [{ pointer, words: fault.message, fault: true }];
  }
  if (!(fault instanceof Problem)) return null;
  if ([401, 403, 429].includes(fault.status) || fault.status >= 500) return null;
  const places = fault.places.filter(({ pointer }) => pointer !== undefined);
  if (!places.length) return [{ pointer: "", words: fault.message, fault: true }];
  return places.map(({ pointer, detail }) => ({
    pointer: pointer!,
    words: detail || fault.message,
    fault: true,
  }));
}
