/** A crowd's columns as rows, and rows as columns. */

import type { CrowdQuestion } from "@posefield/client";

import * as door from "./door.ts";

/** One character of a crowd. */
export interface Row {
  readonly controls: Readonly<Record<string, number>>;
  readonly performer: string | null;
  readonly labels: NonNullable<door.Named["labels"]>;
  readonly level: number;
  readonly time: number;
}

const SERVICE = ["position", "heading", "camera", "from_level", "blend", "budget_ms"] as const;

/** The rows of a crowd; where they stand is not asked for here. */
export function rows(asked: CrowdQuestion): Row[] {
  for (const name of SERVICE) {
    if ((asked[name] ?? null) !== null) throw new door.NeedsService(`a crowd with ${name}`);
  }
  const { time, level, performer, labels = {} } = asked;
  if (level === "auto") throw new door.NeedsService('level "auto"');
  const sets = Object.entries(labels);
  const columns = [
    ...Object.values(asked.controls),
    time,
    level,
    performer,
    ...sets.map(([, column]) => column),
  ];
  const sizes = columns.filter(Array.isArray).map((column) => column.length);
  const [count = 1] = sizes;
  if (sizes.some((each) => each !== count))
    throw new door.Refused("crowd: lists of one length expected");
  const names = Object.keys(asked.controls);
  return Array.from({ length: count }, (_, i) => ({
    controls: Object.fromEntries(names.map((name) => [name, of(asked.controls[name], i)!])),
    performer: of(performer, i) ?? null,
    labels: Object.fromEntries(sets.map(([name, column]) => [name, of(column, i) ?? null])),
    level: of(level, i) ?? 0,
    time: of(time, i) ?? 0,
  }));
}

/** A value for all rows, or that of one row. */
function of<Value>(column: Value | Value[] | undefined, row: number): Value | undefined {
  return Array.isArray(column) ? column[row] : column;
}

export function joined(parts: readonly Float32Array[]): Float32Array {
  const out = new Float32Array(parts.reduce((sum, part) => sum + part.length, 0));
  let first = 0;
  for (const part of parts) {
    out.set(part, first);
    first += part.length;
  }
  return out;
}
