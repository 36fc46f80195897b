/** In words, what a service did to the feet of a clip, or why nothing. */

import type { ModelCard, Trust } from "@posefield/client";

import { whyFeetCannotStand } from "./takes.ts";
import * as written from "./written.ts";

/** Distances below are not worth words, m. */
const SLIGHT = 0.0005;

/** asks: whether a service answers, which alone places feet. */
export function says(
  card: Pick<ModelCard, "feet" | "root">,
  stands: boolean,
  found: Trust["feet"],
  asks = true,
): string {
  if (found) return done(found);
  const why = whyFeetCannotStand(card);
  if (why) return `Feet as predicted: ${why}.`;
  if (!asks) return "Feet as predicted: only a service makes them stand.";
  // Services older than 4.0.0 place no feet and say nothing of them.
  if (stands) return "Feet as predicted: the service did not say that they stand.";
  return "Feet as predicted.";
}

function done({ stances, swings, left, ...found }: NonNullable<Trust["feet"]>): string {
  const others = left.map((sentence) => ` ${ended(sentence)}`).join("");
  if (!stances.length) return `Feet as predicted: none could be placed.${others}`;
  const { skate, skate_before: before, drift, lowered, grounded } = found;
  const parts = [
    `${count(stances.length, "stance")}, ${count(swings, "swing")}`,
    `skate ${slides(before)} before, ${slides(skate)} now`,
    ...(drift > SLIGHT ? [`off its place by up to ${written.centimetres(drift)}`] : []),
    lowered > SLIGHT
      ? `pelvis lowered by up to ${written.centimetres(lowered)}`
      : "pelvis not lowered",
    ...(Math.abs(grounded) > SLIGHT ? [moved(grounded)] : []),
  ];
  return `Feet stand: ${parts.join("; ")}.${others}`;
}

function moved(grounded: number): string {
  const way = written.centimetres(Math.abs(grounded));
  return `body ${grounded > 0 ? "lowered" : "raised"} to the floor by ${way}`;
}

function count(number: number, word: string): string {
  return `${number} ${word}${number === 1 ? "" : "s"}`;
}

function slides(speed: number): string {
  return `${(100 * speed).toFixed(1)} cm/s`;
}

function ended(sentence: string): string {
  return /[.!?]$/.test(sentence) ? sentence : `${sentence}.`;
}
