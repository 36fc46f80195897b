/** Questions about the body that is shown. */

import {
  type CrowdPoses,
  type ModelCard,
  type Motion,
  PosefieldError,
  type Poses,
  Problem,
} from "@posefield/client";

import { curvesAt } from "./curves.ts";
import type { Source } from "./page.ts";
import { pose as posture, sample } from "./playback.ts";
import type { State } from "./state.ts";
import { takeAndFeet, takeFields } from "./takes.ts";

/** Frames a second that a clip is fetched at; poses between them are interpolated. */
const RATE = 60;

export function clip(
  source: Source,
  card: ModelCard,
  state: State,
  signal: AbortSignal,
): Promise<Motion> {
  const { controls, performer, labels, level, loop, model, root } = state;
  const whole = { root, fps: RATE, loop: card.cyclic && loop };
  const how = takeAndFeet(source, card, state);
  const question = { controls, performer, labels, level, ...whole, ...how };
  return source.clip(model, question, signal);
}

/** Beyond this share of a clip the next one may well have ended: it is asked as a whole. */
const LATE = 0.9;

/** The pose at that time, or the last one where the clip has become shorter than that.
 *
 * duration: of the clip before, s.
 */
export async function pose(
  source: Source,
  card: ModelCard,
  state: State,
  time: number,
  duration: number,
  signal: AbortSignal,
): Promise<Poses> {
  const whole = async () => at(await clip(source, card, state, signal), time);
  // Crowds of takes last as long as the prediction does, and have no details.
  const other = Object.keys(takeFields(source, card, state)).length > 0;
  if (other && state.root !== card.root) return whole();
  // A refusal would be mended too, but browsers write each into their console.
  if (time > LATE * Math.min(duration, card.durations[0]!)) return whole();
  try {
    return state.root === card.root
      ? await travelling(source, card, state, time, signal)
      : await inPlace(source, card, state, time, signal);
  } catch (fault) {
    if (!(fault instanceof PosefieldError && /^times?\b/.test(detail(fault)))) throw fault;
    return whole();
  }
}

/** What was found and what was expected: a service says before that what kind of fault it is. */
function detail(fault: PosefieldError): string {
  return fault instanceof Problem ? fault.detail : fault.message;
}

function travelling(
  source: Source,
  card: ModelCard,
  state: State,
  time: number,
  signal: AbortSignal,
) {
  const { controls, performer, labels, level, model } = state;
  const question = { controls, performer, labels, level, times: [time] };
  return source.pose(model, { ...question, ...takeFields(source, card, state) }, signal);
}

/** A crowd of one: crowds alone may be asked for poses that stay where they are. */
async function inPlace(
  source: Source,
  card: ModelCard,
  state: State,
  time: number,
  signal: AbortSignal,
): Promise<Poses> {
  const { controls, performer, labels, level, model } = state;
  const question = { controls, performer, labels, level, time: [time], root: "in_place" as const };
  const answer = await source.crowd(model, question, signal);
  return {
    ...answer,
    times: Float64Array.of(time),
    trust: trust(answer, card, state),
    curves: null,
  };
}

function trust(answer: CrowdPoses, card: ModelCard, state: State): Poses["trust"] {
  const { controls, performer, level } = state;
  const supported = answer.supported?.[0];
  // Services older than 2.2.0 say neither.
  const told = supported === undefined ? {} : { supported, ...seen(card, performer) };
  return {
    model: answer.model,
    controls: { ...controls },
    performer,
    level,
    duration: answer.duration[0]!,
    sigma: answer.sigma[0]!,
    warnings: [...answer.warnings],
    ...told,
  };
}

/** What trust says of who moves, which crowds leave out. */
function seen({ performers }: ModelCard, performer: string | null) {
  return performers.length ? { performer_seen: performer !== null } : {};
}

function at(found: Motion, time: number): Poses {
  const { rotations, root } = sample(posture(found.names.length), found, time);
  return { ...found, rotations, rootPosition: root, curves: curvesAt(found, time) };
}
