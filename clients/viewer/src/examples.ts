/** Captured clips of a model, as places among its controls. */

import type { ModelCard } from "@posefield/client";

import type { Control, Dot } from "./chart.ts";

type Controls = Readonly<Record<string, number>>;

/** Who moved a captured clip; null where nobody is told apart. */
export function mover({ moved_by, performers }: ModelCard, index: number): string | null {
  return performers[moved_by[index] ?? -1] ?? null;
}

/** Label sets besides performers, who are asked for in a field of their own. */
export function otherSets({ labels = [] }: ModelCard): NonNullable<ModelCard["labels"]> {
  return labels.filter(({ name }) => name !== "performer");
}

/** Names of a captured clip in the label sets besides performers. */
export function labelsOf(card: ModelCard, index: number): Record<string, string> {
  const named = otherSets(card).map(({ name, names, clips }) => [name, names[clips[index]!]!]);
  return Object.fromEntries(named) as Record<string, string>;
}

/** Values of the controls that are none of those. */
export function others(controls: Controls, axes: readonly Control[]): Record<string, number> {
  const names = new Set(axes.map(({ name }) => name));
  return Object.fromEntries(Object.entries(controls).filter(([name]) => !names.has(name)));
}

/** Every captured clip on the map of two controls. */
export function clips(card: ModelCard, axes: readonly [Control, Control], now: Controls): Dot[] {
  const [x, y] = axes.map((axis) => card.controls.indexOf(axis)) as [number, number];
  const left = card.left_out ?? [];
  const most = Math.max(...left, 0) || 1;
  return card.examples.map((values, index) => ({
    index,
    at: [values[x]!, values[y]!] as const,
    error: (left[index] ?? 0) / most,
    near: 1 - Math.min(1, 2 * distance(card, now, index, axes)),
  }));
}

/** The greatest gap to a captured clip among the controls that are no axes, as a share of a range. */
export function distance(
  card: ModelCard,
  now: Controls,
  index: number,
  axes: readonly Control[] = [],
): number {
  const values = card.examples[index]!;
  const gaps = card.controls.map((control, i) =>
    axes.includes(control) ? 0 : gap(control, now, values[i]!),
  );
  return Math.max(0, ...gaps);
}

/** The captured clip nearest to controls, each on a scale of its range. */
export function nearestTo(card: ModelCard, now: Controls): { index: number; apart: number } {
  let found = { index: 0, apart: Number.POSITIVE_INFINITY };
  card.examples.forEach((values, index) => {
    const apart = Math.hypot(...card.controls.map((control, i) => gap(control, now, values[i]!)));
    if (apart < found.apart) found = { index, apart };
  });
  return found;
}

function gap(control: Control, now: Controls, value: number): number {
  const own = now[control.name] ?? control.default;
  return Math.abs(own - value) / (control.maximum - control.minimum || 1);
}
