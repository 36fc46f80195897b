/** Sigma and support over two controls, from a table. */

import type { ModelCard, SigmaGrid, SigmaQuestion } from "@posefield/client";

import * as door from "./door.ts";
import type { Tables } from "./read.ts";
import type { Table } from "./table.ts";

const STEPS = 32;
type Control = ModelCard["controls"][number];

export function sigma({ card, answers }: Tables, table: Table, asked: SigmaQuestion): SigmaGrid {
  const [across, along] = [axis(card, asked.across), axis(card, asked.along)];
  if (across === along) throw new door.Refused("along: expected another control than across");
  const margin = asked.margin ?? 0;
  const right = even(across, margin, asked.columns ?? STEPS);
  const up = even(along, margin, asked.rows ?? STEPS);
  const fixed = rest(card, answers.axes, asked, [across, along]);
  const { who } = door.names(card, answers.named, asked);
  const grid = <Item>(item: (values: readonly number[]) => Item) =>
    up.map((y) =>
      right.map((x) =>
        item(door.point(card, answers.axes, { ...fixed, [across.name]: x, [along.name]: y })),
      ),
    );
  const inside = (values: readonly number[]) =>
    card.controls.every((control, i) => door.sampled(control, values[i]!));
  return {
    model: card.identity,
    across: across.name,
    along: along.name,
    controls: fixed,
    performer: asked.performer ?? null,
    ...(asked.labels && { labels: asked.labels }),
    units: Object.fromEntries(card.controls.map(({ name, unit }) => [name, unit])),
    across_values: right,
    along_values: up,
    sigma: grid((values) => table.trust(values, who, 0)[1]),
    inside: grid(inside),
    supported: grid((values) => table.supported(values)),
  };
}

function axis(card: ModelCard, name: string): Control {
  const found = card.controls.find((control) => control.name === name);
  if (!found) throw new door.Refused(`${name}: this model has no such control`);
  return found;
}

function even({ minimum, maximum }: Control, margin: number, count: number): number[] {
  const room = margin * (maximum - minimum);
  const [low, size] = [minimum - room, maximum - minimum + 2 * room];
  return Array.from({ length: count }, (_, i) => low + (i * size) / (count - 1));
}

/** Values of the controls that are no axes, in the card's order. */
function rest(
  card: ModelCard,
  axes: Tables["answers"]["axes"],
  asked: SigmaQuestion,
  apart: readonly Control[],
): Record<string, number> {
  const given: Readonly<Record<string, number>> = asked.controls ?? {};
  return Object.fromEntries(
    card.controls.flatMap((control, i) =>
      apart.includes(control)
        ? []
        : [[control.name, door.value(control, axes[i]!, given[control.name] ?? control.default)]],
    ),
  );
}
