/** Questions about the body that is shown. */

import {
  type CrowdPoses,
  type ModelCard,
  type Motion,
  type Poses,
  Problem,
} from "@posefield/client";

import type { Source } from "./page.ts";
import type { State } from "./state.ts";

/** Frames a second that a clip is fetched at; poses between them are interpolated. */
const RATE = 60;

export function clip(
  source: Source,
  card: ModelCard,
  state: State,
  signal: AbortSignal,
): Promise<Motion> {
  const { controls, performer, level, loop, model, root } = state;
  const question = { controls, performer, level, root, fps: RATE, loop: card.cyclic && loop };
  return source.clip(model, question, signal);
}

/** The pose at that time, or the last one where the clip has become shorter than that. */
export async function pose(
  source: Source,
  card: ModelCard,
  state: State,
  time: number,
  signal: AbortSignal,
): Promise<Poses> {
  try {
    return state.root === card.root
      ? await travelling(source, state, time, signal)
      : await inPlace(source, state, time, signal);
  } catch (fault) {
    if (!(fault instanceof Problem && /^times?\b/.test(fault.detail))) throw fault;
    return last(await clip(source, card, state, signal));
  }
}

function travelling(source: Source, state: State, time: number, signal: AbortSignal) {
  const { controls, performer, level, model } = state;
  return source.pose(model, { controls, performer, level, times: [time] }, signal);
}

/** A crowd of one: crowds alone may be asked for poses that stay where they are. */
async function inPlace(
  source: Source,
  state: State,
  time: number,
  signal: AbortSignal,
): Promise<Poses> {
  const { controls, performer, level, model } = state;
  const question = { controls, performer, level, time: [time], root: "in_place" as const };
  const answer = await source.crowd(model, question, signal);
  return { ...answer, times: Float64Array.of(time), trust: trust(answer, state) };
}

function trust(answer: CrowdPoses, { controls, performer, level }: State): Poses["trust"] {
  return {
    model: answer.model,
    controls: { ...controls },
    performer,
    level,
    duration: answer.duration[0]!,
    sigma: answer.sigma[0]!,
    warnings: [...answer.warnings],
  };
}

function last(found: Motion): Poses {
  return {
    ...found,
    rotations: found.rotations.slice(-4 * found.names.length),
    rootPosition: found.rootPosition.slice(-3),
  };
}
