/** Questions to the service about the state: clips, poses, takes and feet. */

import {
  type ClipQuestion,
  type ModelCard,
  type Motion,
  PosefieldError,
  type PoseQuestion,
  type Poses,
  Problem,
} from "@posefield/client";

import { curvesAt, pose as emptyPose, sample } from "./playback.ts";
import type { Service } from "./service.ts";
import type { State } from "./state.ts";

/** Frames a second of fetched clips; poses between them are interpolated. */
export const RATE = 60;
/** Share of a clip after which the next clip may have ended: then all of it is fetched. */
const LATE = 0.9;
/** Size of deviations where none is given, as the service has it. */
export const VARIETY = 0.7;
/** The greatest seed. */
export const LARGEST_SEED = 999_999_999;
/** The greatest height of a floor, up and down, m. */
export const HIGHEST_FLOOR = 10;
/** Parts of the state that `takeAndFeet` asks for. */
export const TAKE_AND_FEET = ["take", "variety", "detail", "stands", "floor"] as const;

type Asked = Pick<State, (typeof TAKE_AND_FEET)[number]>;

export function clip(
  { client }: Service,
  card: ModelCard,
  state: State,
  signal: AbortSignal,
): Promise<Motion> {
  const { controls, performer, labels, level, loop, model, root } = state;
  const whole = { root, fps: RATE, loop: card.cyclic && loop };
  const rest = { ...targetFields(card, state), ...takeAndFeet(card, state) };
  return client.clip(model, { controls, performer, labels, level, ...whole, ...rest }, signal);
}

/** Return the pose at that time, or the last one where the clip has become shorter.
 *
 * duration: of the clip before, s.
 */
export async function pose(
  service: Service,
  card: ModelCard,
  state: State,
  time: number,
  duration: number,
  signal: AbortSignal,
): Promise<Poses> {
  const { controls, performer, labels, level, model, root } = state;
  const whole = async (): Promise<Poses> => {
    const motion = await clip(service, card, state, signal);
    const { rotations, root } = sample(emptyPose(motion.names.length), motion, time);
    return { ...motion, rotations, rootPosition: root, curves: curvesAt(motion, time) };
  };
  // A refusal would be answered by the whole clip too, but browsers write each into their console.
  const late = time > LATE * Math.min(duration, card.durations[0]!);
  if (late || root !== card.root) return whole();
  const rest = { ...targetFields(card, state), ...takeFields(card, state) };
  const question = { controls, performer, labels, level, times: [time], ...rest };
  try {
    return await service.client.pose(model, question, signal);
  } catch (fault) {
    const detail = fault instanceof Problem ? fault.detail : String(fault);
    if (!(fault instanceof PosefieldError && /^times?\b/.test(detail))) throw fault;
    return whole();
  }
}

/** Fields of a question that ask for the state's target. */
export function targetFields(
  { event, skeleton }: ModelCard,
  { target }: Pick<State, "target">,
): Pick<ClipQuestion, "targets"> {
  if (!target || !event) return {};
  const position = target.map((value) => Number(value.toFixed(4)));
  return { targets: [{ joint: skeleton.names[event.joint]!, at: "event", position }] };
}

/** Fields of a question that ask for another take. */
export function takeFields(
  card: ModelCard,
  { take, variety, detail }: Pick<Asked, "take" | "variety" | "detail">,
): Pick<PoseQuestion, "take" | "variety" | "detail"> {
  const details = detail && hasDetail(card);
  if (!(take || details)) return {};
  return {
    ...(take && { take }),
    ...(variety !== VARIETY && { variety }),
    ...(details && { detail: true }),
  };
}

/** Fields of a question for a clip: of its take, and of its feet. */
export function takeAndFeet(
  card: ModelCard,
  state: Asked,
): Pick<ClipQuestion, "take" | "variety" | "detail" | "feet" | "floor"> {
  const floor = floorOf(card, state);
  return {
    ...takeFields(card, state),
    ...(state.stands !== standsByDefault(card) && {
      feet: state.stands ? "stand" : "as_predicted",
    }),
    ...(floor && { floor }),
  };
}

/** Return the seed after this one; after the last, the first again. */
export function nextSeed(take: number): number {
  return (take % LARGEST_SEED) + 1;
}

/** Return the first seeds without this one. */
export function otherTakes(take: number, count: number): readonly number[] {
  const seeds = Array.from({ length: count + 1 }, (_, i) => i + 1);
  return seeds.filter((seed) => seed !== take).slice(0, count);
}

/** Tell whether the model has details to sample, which no control predicts. */
export function hasDetail({ diagnostics }: Pick<ModelCard, "diagnostics">): boolean {
  return Boolean((diagnostics as Readonly<Record<string, unknown>> | undefined)?.["detail"]);
}

/** Say why the service cannot make these feet stand; null where it can. */
export function whyFeetCannotStand({
  feet,
  root,
}: Pick<ModelCard, "feet" | "root">): string | null {
  if (!feet.length) return "this model names no feet";
  if (root === "in_place") return "this model's root stays in place";
  return null;
}

/** Tell whether the service makes the feet of a model's clips stand by default. */
export function standsByDefault(card: ModelCard): boolean {
  return !whyFeetCannotStand(card) && Boolean(card.contacts?.length);
}

/** Return the height of the floor on which feet stand, m; 0 where they are as predicted. */
export function floorOf(
  card: Pick<ModelCard, "feet" | "root">,
  { stands, floor }: Pick<State, "stands" | "floor">,
): number {
  return stands && !whyFeetCannotStand(card) ? floor : 0;
}
