/** The model's graphs in onnxruntime-web: one for each level, loaded when it is first wanted. */

import type { ModelCard } from "@posefield/client";
import type * as Runtime from "onnxruntime-web/wasm";

import { Bounds } from "./bounds.ts";

export type Ort = typeof Runtime;

/** Rows a call: more would leave a core's cache. */
const BATCH = 1024;
const SIZES = { rotations: 4, root_position: 3, bone_offsets: 3, duration: 1, sigma: 1, travel: 3 };

export type Output = keyof typeof SIZES;

/** B rows for the graph: controls B × d, times B × S, and weights of all labels B × p. */
export interface Rows {
  readonly count: number;
  readonly controls: Float32Array;
  readonly times: Float32Array;
  readonly labels: Float32Array;
}

/** Outputs, row by row; those of models with curves have `curves`. */
export type Answers = Readonly<Record<Output, Float32Array>> & { readonly curves?: Float32Array };

let last: Promise<unknown> = Promise.resolve();

/** Wait for all earlier work: onnxruntime-web mixes up the outputs of calls at the same time. */
function inTurn<Result>(work: () => Promise<Result>): Promise<Result> {
  const done = last.then(work, work);
  last = done.catch(() => undefined);
  return done;
}

export class Graph {
  readonly #ort: Ort;
  readonly #levels: (level: number) => Promise<Uint8Array>;
  readonly #card: ModelCard;
  readonly #bounds: Bounds;
  readonly #sessions: (Promise<Runtime.InferenceSession> | undefined)[] = [];

  /** levels: the file of each level. */
  constructor(ort: Ort, levels: (level: number) => Promise<Uint8Array>, card: ModelCard) {
    this.#ort = ort;
    this.#levels = levels;
    this.#card = card;
    this.#bounds = new Bounds(card);
  }

  /** Answers, bounded outside the sampled ranges as service/posefield/inference/session.py bounds
   * them; sigma is that of the controls as asked. */
  async run(rows: Rows, level: number): Promise<Answers> {
    const outside = this.#bounds.outside(rows.controls);
    if (!outside.includes(true)) return this.unbounded(rows, level);
    const begin = { ...rows, times: new Float32Array(rows.count) };
    const limited = this.#bounds.limit(rows.controls);
    const { duration: raw } = await this.unbounded({ ...begin, controls: limited }, level);
    const inside = { ...begin, controls: this.#bounds.nearest(rows.controls) };
    const { duration: nearest } = await this.unbounded(inside, level);
    const bounded = raw.map((found, row) => this.#bounds.duration(found, nearest[row]!));
    const steps = rows.times.length / rows.count;
    // The graph places a time by the duration that it computes itself.
    const times = rows.times.map((time, i) => {
      const row = Math.floor(i / steps);
      return (time * raw[row]!) / bounded[row]!;
    });
    const found = await this.unbounded({ ...rows, controls: limited, times }, level);
    const { sigma } = await this.unbounded({ ...begin, controls: rows.controls }, level);
    return {
      ...found,
      duration: found.duration.map((own, row) => (raw[row] === bounded[row] ? own : bounded[row]!)),
      sigma: found.sigma.map((own, row) => (outside[row] ? sigma[row]! : own)),
    };
  }

  /** What the graph answers at any controls. */
  async unbounded(rows: Rows, level: number): Promise<Answers> {
    const steps = rows.times.length / rows.count;
    const joints = this.#card.skeleton.parents.length;
    const shared = { rotations: steps * joints, root_position: steps, bone_offsets: joints };
    const widths = { ...shared, duration: 1, sigma: 1, travel: steps, curves: steps };
    const curves = this.#card.curves?.length ?? 0;
    const own = curves ? { ...SIZES, curves } : SIZES;
    const sizes = Object.entries(own) as [Output, number][];
    const whole = Object.fromEntries(
      sizes.map(([name, size]) => [name, new Float32Array(rows.count * widths[name] * size)]),
    ) as Record<Output, Float32Array>;
    for (let first = 0; first < rows.count; first += BATCH) {
      const found = await this.#batch(rows, first, Math.min(BATCH, rows.count - first), level);
      for (const [name, size] of sizes) {
        whole[name].set(found[name]!.data as Float32Array, first * widths[name] * size);
      }
    }
    return whole;
  }

  async #batch(rows: Rows, first: number, count: number, level: number) {
    const [width, steps] = [this.#card.controls.length, rows.times.length / rows.count];
    const part = (all: Float32Array, size: number) =>
      new this.#ort.Tensor("float32", all.slice(size * first, size * (first + count)), [
        count,
        size,
      ]);
    const feeds: Record<string, Runtime.Tensor> = {
      controls: part(rows.controls, width),
      time: part(rows.times, steps),
    };
    if (rows.labels.length) feeds["labels"] = part(rows.labels, rows.labels.length / rows.count);
    const session = await this.#session(level);
    return inTurn(() => session.run(feeds));
  }

  #session(level: number): Promise<Runtime.InferenceSession> {
    this.#sessions[level] ??= this.#opened(level);
    return this.#sessions[level];
  }

  async #opened(level: number): Promise<Runtime.InferenceSession> {
    const graph = await this.#levels(level);
    const options = { executionProviders: ["wasm"], logSeverityLevel: 3 } as const;
    return inTurn(() => this.#ort.InferenceSession.create(graph, options));
  }
}
