/** What a model in the browser can be asked: checked as the service checks it, in fewer words. */

import { type ModelCard, PosefieldError } from "@posefield/client";

/** A question that has no answer. */
export class Refused extends PosefieldError {
  override readonly name = "Refused";
  readonly kind = "invalid-field";
}

/** A question that only a service answers. */
export class NeedsService extends PosefieldError {
  override readonly name = "NeedsService";

  constructor(what: string) {
    super(`${what} needs a service: this page runs without one, on the model file alone`);
  }
}

type Control = ModelCard["controls"][number];

/** Clips so many times longer or shorter than any that was captured are no motion any more. */
const FARTHEST = 10;
const REACH = 100;
const SLACK = 1e-6;

/** The controls' values in the card's order. */
export function point(card: ModelCard, given: Readonly<Record<string, number>>): number[] {
  for (const name of Object.keys(given)) {
    if (!card.controls.some((control) => control.name === name)) {
      throw new Refused(`${name}: this model has no such control`);
    }
  }
  return card.controls.map((control) => value(control, given[control.name]));
}

export function value(control: Control, given: number | undefined): number {
  const { name, unit, minimum, maximum } = control;
  const room = REACH * (maximum - minimum);
  if (given === undefined) throw new Refused(`${name}: missing, expected a number in ${unit}`);
  if (!(given >= minimum - room && given <= maximum + room)) {
    throw new Refused(`${name}: ${given} ${unit}, expected ${minimum} to ${maximum} or near it`);
  }
  return given;
}

/** A sentence for each control outside what was sampled. */
export function warnings(card: ModelCard, values: readonly number[]): string[] {
  return card.controls.flatMap((control, i) => {
    const { name, unit, minimum, maximum } = control;
    if (sampled(control, values[i]!)) return [];
    const range = `${short(minimum)} to ${short(maximum)} ${unit}`;
    return [`${name} = ${short(values[i]!)} ${unit} lies outside what was sampled, ${range}`];
  });
}

export const GAP = "these controls lie in a gap of what was sampled: nothing like it was captured";

export function sampled({ minimum, maximum }: Control, value: number): boolean {
  const slack = SLACK * (maximum - minimum);
  return value >= minimum - slack && value <= maximum + slack;
}

type Label = string | Readonly<Record<string, number>>;

/** What a question says of labels; the performer is short for the label set of that name. */
export interface Named {
  readonly performer?: string | null;
  readonly labels?: Readonly<Record<string, Label | null>>;
}

/** A weight for each name of all label sets, in the graph's order; zeros where a set is open. */
export function weights(card: ModelCard, { performer = null, labels = {} }: Named): number[] {
  const sets = card.labels ?? [];
  const asked = performer === null ? labels : { ...labels, performer };
  for (const name of Object.keys(asked)) {
    if (!sets.some((set) => set.name === name))
      throw new Refused(`${name}: this model has no such label set`);
  }
  return sets.flatMap(({ name, names }) => setWeights(name, names, asked[name] ?? {}));
}

function setWeights(set: string, names: readonly string[], label: Label): number[] {
  const given: Readonly<Record<string, number>> =
    typeof label === "string" ? { [label]: 1 } : label;
  const unknown = Object.keys(given).find((name) => !names.includes(name));
  if (unknown !== undefined)
    throw new Refused(`${set}: ${unknown}, expected one of ${names.join(", ")}`);
  return names.map((name) => given[name] ?? 0);
}

export function level(card: ModelCard, asked: number): number {
  if (Number.isInteger(asked) && asked >= 0 && asked < card.levels.length) return asked;
  throw new Refused(`level: ${asked}, expected 0 to ${card.levels.length - 1}`);
}

/** A duration, s, that extrapolation has not lost all sense in. */
export function sensible(card: ModelCard, duration: number): number {
  const [shortest, longest] = [card.durations[0]!, card.durations[1]!];
  if (duration >= shortest / FARTHEST && duration <= longest * FARTHEST) return duration;
  throw new Refused(`controls: so far outside that the clip would last ${short(duration)} s`);
}

export function within(name: string, value: number, low: number, high: number): number {
  if (value >= low && value <= high) return value;
  throw new Refused(`${name}: ${short(value)}, expected ${short(low)} to ${short(high)}`);
}

const short = (value: number): string => String(Number(value.toPrecision(6)));
