/** Page in which the answers of the run time are compared and timed. */

import { load, type Model, type Walkers } from "../../src/index.ts";
import { differences as compare, type Differences, type ModelAnswers } from "../answers.ts";

const models = new Map<string, Model>();
const crowds = new Map<number, Walkers>();

export async function differences(url: string, answers: ModelAnswers): Promise<Differences> {
  const content = await (await fetch(url)).arrayBuffer();
  return compare(new Uint8Array(content), answers);
}

/** Compute a pose, or a clip, some times. */
export async function repeat(url: string, kind: "pose" | "clip", fps: number, count: number) {
  const model = models.get(url) ?? (await load(url));
  models.set(url, model);
  for (let index = 0; index < count; index++)
    if (kind === "pose") await model.pose(model.defaults, 0.3);
    else await model.clip(model.defaults, { fps });
}

/** Move walkers on some times, each at a speed and a turn of its own. */
export async function walk(url: string, walkers: number, count: number): Promise<void> {
  const model = models.get(url) ?? (await load(url));
  models.set(url, model);
  const crowd = crowds.get(walkers) ?? (await model.walkers(walkers));
  crowds.set(walkers, crowd);
  for (let index = 0; index < walkers; index++)
    crowd.steer(index, { speed: 0.6 + index / walkers, turn: Math.sin(index) });
  for (let frame = 0; frame < count; frame++) await crowd.step(1 / 60);
}

Object.assign(globalThis, { posefield: { differences, repeat, walk } });
