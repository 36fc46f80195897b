/** Levels of detail by what shows of their errors: the service's own rule (POST crowd, `auto`). */

import type { ModelCard } from "@posefield/client";

/** A coarser level than that held is taken where its error is below the limit by this share. */
export const HYSTERESIS = 0.2;

/** A lens: vertical field of view, rad, and height of the image, pixels. */
export interface Lens {
  readonly fov: number;
  readonly height: number;
}

/** The lens that a canvas is seen through, at the screen's own pixels, however coarsely it is drawn. */
export function lens(fov: number, canvas: HTMLCanvasElement): Lens {
  return { fov: (fov * Math.PI) / 180, height: canvas.clientHeight * devicePixelRatio };
}

/** What the rule knows of a model. */
export interface Ladder {
  /** Error of each level's worst pose, m; none is below that of a finer one. */
  readonly errors: Float64Array;
  /** Where the root is at rest, m. */
  readonly middle: readonly number[];
  /** Of a sphere about the root that holds the body at rest, m. */
  readonly radius: number;
}

export function ladder(card: ModelCard): Ladder {
  const errors = Float64Array.from(card.levels, ({ pose }) => pose);
  for (let i = 1; i < errors.length; i++) errors[i] = Math.max(errors[i]!, errors[i - 1]!);
  return { errors, middle: card.skeleton.offsets[0]!, radius: radius(card) };
}

function radius({ skeleton }: ModelCard): number {
  const rest: number[][] = [];
  skeleton.parents.forEach((parent, joint) => {
    const from = parent <= 0 ? [0, 0, 0] : rest[parent]!;
    rest.push(
      parent < 0 ? [0, 0, 0] : from.map((value, i) => value + skeleton.offsets[joint]![i]!),
    );
  });
  return Math.max(...rest.map((point) => Math.hypot(...point)));
}

/** Pixels that a metre covers at a metre's distance, in the middle of the image. */
export function pixels(lens: Lens): number {
  return lens.height / (2 * Math.tan(lens.fov / 2));
}

/** The coarsest level whose error covers at most `limit` pixels where a metre covers `scale`; with
 * the level held before, a coarser one must keep the limit less HYSTERESIS of it. */
export function choose(errors: Float64Array, scale: number, limit: number, previous = -1): number {
  let level = 0;
  for (let coarser = 1; coarser < errors.length; coarser++) {
    const own = errors[coarser]! * scale;
    const threshold = previous >= 0 && coarser > previous ? own / (1 - HYSTERESIS) : own;
    if (threshold <= limit) level++;
  }
  return level;
}

/** Metres from which on a level's worst pose covers less than a pixel. */
export function farEnough(own: Ladder, level: number, lens: Lens): number {
  return own.errors[level]! * pixels(lens) + own.radius;
}
