/** Choice of a level of detail by its error in pixels: the rule of the service (crowds, `auto`). */

import type { ModelCard } from "@posefield/client";

/** Share of the limit by which the error of a coarser level must be below it. */
const HYSTERESIS = 0.2;

/** A lens: vertical field of view, rad, and height of the image, pixels. */
export interface Lens {
  readonly fov: number;
  readonly height: number;
}

/** Return the lens of a canvas, in pixels of the screen, however coarsely it is drawn. */
export function lens(fov: number, canvas: HTMLCanvasElement): Lens {
  return { fov: (fov * Math.PI) / 180, height: canvas.clientHeight * devicePixelRatio };
}

/** Errors and size of a model. */
export interface Ladder {
  /** Error of each level's worst pose, m; none is below that of a finer one. */
  readonly errors: Float64Array;
  /** Position of the root at rest, m. */
  readonly middle: readonly number[];
  /** Radius of a sphere about the root that contains the body at rest, m. */
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

/** Return the pixels that a metre covers at a metre's distance, in the middle of the image. */
export function pixels(lens: Lens): number {
  return lens.height / (2 * Math.tan(lens.fov / 2));
}

/** Return the coarsest level whose error covers at most `limit` pixels, where a metre covers `scale`.
 *
 * previous: level before; a coarser one must be below the limit by HYSTERESIS. */
export function choose(errors: Float64Array, scale: number, limit: number, previous = -1): number {
  let level = 0;
  for (let coarser = 1; coarser < errors.length; coarser++) {
    const error = errors[coarser]! * scale;
    const margin = previous >= 0 && coarser > previous ? 1 - HYSTERESIS : 1;
    if (error / margin <= limit) level++;
  }
  return level;
}

/** Return the metres from which on a level's worst pose is off by less than a pixel. */
export function farEnough({ errors, radius }: Ladder, level: number, lens: Lens): number {
  return errors[level]! * pixels(lens) + radius;
}

/** Give an element the colour of a level, as the custom property --level. */
export function withLevel<Kind extends HTMLElement>(element: Kind, level: number): Kind {
  element.style.setProperty("--level", `var(--level-${Math.min(level, 3)})`);
  return element;
}
