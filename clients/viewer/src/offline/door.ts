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

/** Place of a performer among the card's; -1 for nobody that was seen. */
export function performer(card: ModelCard, name: string | null | undefined): number {
  if (name === null || name === undefined) return -1;
  const place = card.performers.indexOf(name);
  if (place < 0)
    throw new Refused(`performer: ${name}, expected one of ${card.performers.join(", ")}`);
  return place;
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
