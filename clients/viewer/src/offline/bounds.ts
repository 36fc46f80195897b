/** Bounds of answers outside the sampled ranges: service/posefield/model_file/answer_bounds.py. */

import type { ModelCard } from "@posefield/client";

import { band } from "../bands.ts";

const MARGIN = 0.25;
const SLACK = 1e-6;
/** Share of a range by which a control acts at another value without a word. */
const DEVIATION = 1e-3;

type Control = ModelCard["controls"][number];

/** A requested control whose value the motion does not have. */
export interface Deviation {
  readonly control: string;
  readonly asked: number;
  readonly given: number;
  readonly unit: string;
  readonly captured: [number, number];
  readonly side: "above" | "below";
}

/** The value at which a control acts: at most the margin outside its sampled range. */
export function limited({ minimum, maximum }: Control, value: number): number {
  const room = MARGIN * (maximum - minimum);
  return Math.min(Math.max(value, minimum - room), maximum + room);
}

export class Bounds {
  readonly #controls: readonly Control[];
  readonly #shortest: number;
  readonly #longest: number;

  constructor({ controls, durations }: Pick<ModelCard, "controls" | "durations">) {
    this.#controls = controls;
    this.#shortest = durations[0]! * (1 - MARGIN);
    this.#longest = durations[1]! * (1 + MARGIN);
  }

  /** Whether a control of each row lies outside its sampled range. */
  outside(controls: Float32Array): boolean[] {
    const width = this.#controls.length;
    return Array.from({ length: controls.length / width }, (_, row) =>
      this.#controls.some(({ minimum, maximum }, i) => {
        const [value, slack] = [controls[row * width + i]!, SLACK * (maximum - minimum)];
        return value < minimum - slack || value > maximum + slack;
      }),
    );
  }

  /** The controls at which an answer is computed. */
  limit(controls: Float32Array): Float32Array {
    return this.#mapped(controls, limited);
  }

  /** The nearest controls inside the sampled ranges. */
  nearest(controls: Float32Array): Float32Array {
    return this.#mapped(controls, ({ minimum, maximum }, value) =>
      Math.min(Math.max(value, minimum), maximum),
    );
  }

  /** A duration, s, at most the margin off the captured ones, or that at the nearest controls. */
  duration(found: number, nearest: number): number {
    const least = Math.min(this.#shortest, nearest);
    return Math.min(Math.max(found, least), Math.max(this.#longest, nearest));
  }

  #mapped(controls: Float32Array, change: (control: Control, value: number) => number) {
    const width = this.#controls.length;
    return controls.map((value, i) => change(this.#controls[i % width]!, value));
  }
}

/** A deviation for each control that acts at another value than the given one. */
export function deviations(card: ModelCard, values: readonly number[]): Deviation[] {
  return card.controls.flatMap((control, i) => {
    const [asked, given] = [values[i]!, limited(control, values[i]!)];
    const { name, unit, minimum, maximum } = control;
    if (Math.abs(asked - given) <= DEVIATION * (maximum - minimum)) return [];
    const side = given > asked ? ("above" as const) : ("below" as const);
    return [{ control: name, asked, given, unit, captured: [minimum, maximum], side }];
  });
}

/** A deviation in words, as the service writes it. */
export function sentence({ control, asked, given, unit, captured, side }: Deviation): string {
  const [low, high] = captured.map(short);
  const of = unit ? ` ${unit}` : "";
  return (
    `${control}: asked ${short(asked)}${of}, given ${short(given)}${of}, ` +
    `captured ${low} to ${high}${of}; ${side} what was asked`
  );
}

/** One warning for each control: a deviation tells the sampled range, too. */
export function merged(warnings: readonly string[], found: readonly Deviation[]): string[] {
  const told = new Map(found.map((each) => [`${each.control} =`, sentence(each)]));
  const merged = warnings.map((text) => {
    const key = text.split(" ", 2).join(" ");
    const own = told.get(key) ?? text;
    told.delete(key);
    return own;
  });
  return [...merged, ...told.values()];
}

/** What trust says of deviations, and the band of sigma. */
export function told(found: readonly Deviation[], sigma: number) {
  return { ...(found.length ? { deviations: [...found] } : {}), band: band(sigma) };
}

const short = (value: number): string => String(Number(value.toPrecision(4)));
