/** What a copy of the page can be asked: checked as the service checks it, in fewer words. */

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
    super(`${what} needs a service: this page runs without one, on answers computed beforehand`);
  }
}

type Control = ModelCard["controls"][number];

/** Share of a range by which a control at its end may lie outside by rounding. */
const SLACK = 1e-6;

/** The controls' values in the card's order.
 *
 * axes: of each control, the values in the table.
 */
export function point(
  card: ModelCard,
  axes: readonly (readonly number[])[],
  given: Readonly<Record<string, number>>,
): number[] {
  for (const name of Object.keys(given)) {
    if (!card.controls.some((control) => control.name === name)) {
      throw new Refused(`${name}: this model has no such control`);
    }
  }
  return card.controls.map((control, i) => value(control, axes[i]!, given[control.name]));
}

/** A value in the table's range. */
export function value(
  { name, unit }: Control,
  axis: readonly number[],
  given: number | undefined,
): number {
  if (given === undefined) throw new Refused(`${name}: missing, expected a number in ${unit}`);
  const [low, high] = [axis[0]!, axis.at(-1)!];
  const slack = SLACK * (high - low);
  if (given >= low - slack && given <= high + slack) return Math.min(high, Math.max(low, given));
  const range = `${short(low)} to ${short(high)} ${unit}`;
  throw new Refused(`${name}: ${short(given)} ${unit}, expected ${range}: this copy has no others`);
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

/** What a question names: of the set whose names are in the table, and of those that it lacks. */
export interface Names {
  /** Place in the named set, -1 where it is left open. */
  readonly who: number;
  /** As an answer repeats it. */
  readonly performer: string | null;
  readonly labels: Readonly<Record<string, string>>;
  /** A sentence for each label that the answer leaves out. */
  readonly left: readonly string[];
}

/** named: the label set whose names are in the table. */
export function names(
  { labels: sets = [] }: ModelCard,
  named: string | null,
  { performer, labels = {} }: Named,
): Names {
  const short = performer ?? null;
  if (short !== null && labels["performer"])
    throw new Refused("performer: expected once, by itself or in labels");
  let found = { who: -1, performer: null as string | null, labels: {} };
  const left: string[] = [];
  for (const [set, label] of Object.entries({ ...labels, ...(short !== null && { performer }) })) {
    if (label === null || label === undefined) continue;
    const known = sets.find(({ name }) => name === set);
    if (!known) throw new Refused(`${set}: this model has no such label set`);
    const who = index(set, known.names, label);
    const name = known.names[who]!;
    if (set !== named) left.push(`${set}: ${name} was left out, this copy has no answers for it`);
    else if (set === "performer") found = { who, performer: name, labels: {} };
    else found = { who, performer: null, labels: { [set]: name } };
  }
  return { ...found, left };
}

function index(set: string, names: readonly string[], label: Label): number {
  if (typeof label !== "string") throw new NeedsService(`a mixture of names of ${set}`);
  const found = names.indexOf(label);
  if (found >= 0) return found;
  throw new Refused(`${set}: ${label}, expected one of ${names.join(", ")}`);
}

export function level(card: ModelCard, asked: number): number {
  if (Number.isInteger(asked) && asked >= 0 && asked < card.levels.length) return asked;
  throw new Refused(`level: ${asked}, expected 0 to ${card.levels.length - 1}`);
}

export function within(name: string, value: number, low: number, high: number): number {
  if (value >= low && value <= high) return value;
  throw new Refused(`${name}: ${short(value)}, expected ${short(low)} to ${short(high)}`);
}

const short = (value: number): string => String(Number(value.toPrecision(6)));
