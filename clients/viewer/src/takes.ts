/** Takes of a motion and how its feet are, as the state has them: what is asked of a service. */

import type { ClipQuestion, ModelCard, PoseQuestion } from "@posefield/client";

import { type Source, served } from "./page.ts";
import type { State } from "./state.ts";

/** Size of deviations where none is given, as the service has it. */
export const VARIETY = 0.7;
/** The greatest seed. */
export const LARGEST_SEED = 999_999_999;

/** The greatest height of a floor, up and down, m. */
export const HIGHEST_FLOOR = 10;

/** Parts of the state that takeAndFeet() asks for. */
export const TAKE_AND_FEET = ["take", "variety", "detail", "stands", "floor"] as const;

/** The seed after this one; after the last, the first again. */
export function nextSeed(take: number): number {
  return (take % LARGEST_SEED) + 1;
}

/** Seeds of takes to be shown beside this one: from 1 on, without it. */
export function otherTakes(take: number, count: number): readonly number[] {
  const some = Array.from({ length: count + 1 }, (_, i) => i + 1);
  return some.filter((seed) => seed !== take).slice(0, count);
}

/** Whether the model has details to sample, which no control predicts. */
export function hasDetail({ diagnostics }: Pick<ModelCard, "diagnostics">): boolean {
  return Boolean((diagnostics as Readonly<Record<string, unknown>> | undefined)?.["detail"]);
}

/** In words, why a service cannot make these feet stand; null where it can. */
export function whyFeetCannotStand({
  feet,
  root,
}: Pick<ModelCard, "feet" | "root">): string | null {
  if (!feet.length) return "this model names no feet";
  if (root === "in_place") return "this model's root stays in place";
  return null;
}

/** Whether the service makes the feet of a model's clips stand unless it is told otherwise. */
export function standsByDefault(card: ModelCard): boolean {
  return !whyFeetCannotStand(card) && Boolean(card.contacts?.length);
}

/** Height of the floor on which the feet of clips stand, m; 0 where they are as predicted. */
export function floorOf(
  source: Source,
  card: Pick<ModelCard, "feet" | "root">,
  { stands, floor }: Pick<State, "stands" | "floor">,
): number {
  return served(source) && stands && !whyFeetCannotStand(card) ? floor : 0;
}

/** Fields of a question that ask for another take; none where no service answers. */
export function takeFields(
  source: Source,
  card: ModelCard,
  { take, variety, detail }: Pick<State, "take" | "variety" | "detail">,
): Pick<PoseQuestion, "take" | "variety" | "detail"> {
  const details = detail && hasDetail(card);
  if (!served(source) || !(take || details)) return {};
  return {
    ...(take && { take }),
    ...(variety !== VARIETY && { variety }),
    ...(details && { detail: true }),
  };
}

/** Fields of a question for a clip: of its take, and of its feet. */
export function takeAndFeet(
  source: Source,
  card: ModelCard,
  state: Pick<State, "take" | "variety" | "detail" | "stands" | "floor">,
): Pick<ClipQuestion, "take" | "variety" | "detail" | "feet" | "floor"> {
  const floor = floorOf(source, card, state);
  const told = served(source) && state.stands !== standsByDefault(card);
  return {
    ...takeFields(source, card, state),
    ...(told && { feet: state.stands ? "stand" : "as_predicted" }),
    ...(floor && { floor }),
  };
}
