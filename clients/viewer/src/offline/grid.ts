/** Sigma and support over two controls, by the model in the browser. */

import type { ModelCard, SigmaGrid, SigmaQuestion } from "@posefield/client";

import * as door from "./door.ts";
import type { Graph } from "./graph.ts";
import type { Support } from "./support.ts";

const STEPS = 32;
type Control = ModelCard["controls"][number];

export async function sigma(
  graph: Graph,
  card: ModelCard,
  support: Support,
  asked: SigmaQuestion,
): Promise<SigmaGrid> {
  const [across, along] = [axis(card, asked.across), axis(card, asked.along)];
  if (across === along) throw new door.Refused("along: expected another control than across");
  const margin = asked.margin ?? 0;
  const right = even(across, margin, asked.columns ?? STEPS);
  const up = even(along, margin, asked.rows ?? STEPS);
  const fixed = rest(card, asked, [across, along]);
  const rows = up.flatMap((y) =>
    right.map((x) => ({ ...fixed, [across.name]: x, [along.name]: y })),
  );
  const points = rows.map((row) => card.controls.map(({ name }) => row[name]!));
  const named = door.weights(card, asked);
  const labels = Float32Array.from(points.flatMap(() => named));
  const times = new Float32Array(points.length);
  const controls = Float32Array.from(points.flat());
  const found = await graph.unbounded({ count: points.length, controls, times, labels }, 0);
  const split = <Item>(all: readonly Item[]) =>
    up.map((_, row) => all.slice(row * right.length, (row + 1) * right.length));
  const within = (values: readonly number[]) =>
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
    sigma: split([...found.sigma]),
    inside: split(points.map(within)),
    supported: split(points.map((values) => support.holds(values))),
  };
}

function axis(card: ModelCard, name: string): Control {
  const found = card.controls.find((control) => control.name === name);
  if (!found) throw new door.Refused(`${name}: this model has no such control`);
  return found;
}

function even({ minimum, maximum }: Control, margin: number, count: number): number[] {
  const [low, size] = [
    minimum - margin * (maximum - minimum),
    (1 + 2 * margin) * (maximum - minimum),
  ];
  return Array.from({ length: count }, (_, i) => low + (i * size) / (count - 1));
}

/** Values of the controls that are no axes, in the card's order. */
function rest(
  card: ModelCard,
  asked: SigmaQuestion,
  axes: readonly Control[],
): Record<string, number> {
  const given: Readonly<Record<string, number>> = asked.controls ?? {};
  return Object.fromEntries(
    card.controls
      .filter((control) => !axes.includes(control))
      .map((control) => [
        control.name,
        door.value(control, given[control.name] ?? control.default),
      ]),
  );
}
