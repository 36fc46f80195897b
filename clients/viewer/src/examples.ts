/** Captured clips of a model, as points among its controls. */

import type { ModelCard } from "@posefield/client";

export type Control = ModelCard["controls"][number];

/** A captured clip on the map of two controls. */
export interface Dot {
  readonly index: number;
  readonly at: readonly [number, number];
  /** Share of the largest leave-one-out error. */
  readonly error: number;
  /** 1 where the other controls are those of the clip. */
  readonly near: number;
}

type Controls = Readonly<Record<string, number>>;

/** Return the performer of a captured clip; null for a model without performers. */
export function performerOf({ moved_by, performers }: ModelCard, index: number): string | null {
  return performers[moved_by[index] ?? -1] ?? null;
}

/** Return the label sets besides performers. */
export function otherSets({ labels = [] }: ModelCard): NonNullable<ModelCard["labels"]> {
  return labels.filter(({ name }) => name !== "performer");
}

/** Return the labels of a captured clip besides its performer. */
export function labelsOf(card: ModelCard, index: number): Record<string, string> {
  const named = otherSets(card).map(({ name, names, clips }) => [name, names[clips[index]!]!]);
  return Object.fromEntries(named) as Record<string, string>;
}

/** Return the values of the other controls. */
export function others(controls: Controls, axes: readonly Control[]): Record<string, number> {
  const names = new Set(axes.map(({ name }) => name));
  return Object.fromEntries(Object.entries(controls).filter(([name]) => !names.has(name)));
}

/** Return the captured clips on the map of two controls. */
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

/** Return the greatest gap to a captured clip in a control that is no axis, as a share of its range. */
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

/** Return the captured clip nearest to the controls, each on a scale of its range. */
export function nearestTo(card: ModelCard, now: Controls): { index: number; apart: number } {
  let nearest = { index: 0, apart: Number.POSITIVE_INFINITY };
  card.examples.forEach((values, index) => {
    const apart = Math.hypot(...card.controls.map((control, i) => gap(control, now, values[i]!)));
    if (apart < nearest.apart) nearest = { index, apart };
  });
  return nearest;
}

function gap(control: Control, now: Controls, value: number): number {
  const current = now[control.name] ?? control.default;
  return Math.abs(current - value) / (control.maximum - control.minimum || 1);
}
