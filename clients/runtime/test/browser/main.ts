/** Page in which the answers of the run time are compared and timed. */

import { load, type Model } from "../../src/index.ts";
import { differences as compare, type Differences, type ModelAnswers } from "../answers.ts";

const models = new Map<string, Model>();

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

Object.assign(globalThis, { posefield: { differences, repeat } });
