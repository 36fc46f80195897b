/** Questions and files that are refused, and by which error. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { InvalidField, load, ModelError } from "../src/index.ts";

const SHIPPED = new URL("../../../service/posefield/shipped/", import.meta.url);
const content = readFileSync(new URL("cmu_walk.onnx", SHIPPED));
const model = await load(content);

function names(field: string) {
  return (fault: unknown) => fault instanceof InvalidField && fault.field === field;
}

test("a question is refused by the field that is wrong", async () => {
  const { defaults } = model;
  await assert.rejects(model.pose({ ...defaults, pace: 1 }, 0), names("controls/pace"));
  await assert.rejects(model.pose({ speed: 1 }, 0), names("controls/turn"));
  await assert.rejects(model.pose({ ...defaults, speed: Number.NaN }, 0), names("controls/speed"));
  await assert.rejects(model.pose({ ...defaults, speed: 1.9 }, 0), names("controls/speed"));
  await assert.rejects(model.pose(defaults, 99), names("times/0"));
  await assert.rejects(model.clip(defaults, { loops: true } as object), names("loops"));
  await assert.rejects(model.pose(defaults, []), names("times"));
  await assert.rejects(model.pose(defaults, 0, { level: 9 }), names("level"));
  await assert.rejects(model.pose(defaults, 0, { performer: "nobody" }), names("labels/performer"));
  await assert.rejects(model.pose(defaults, 0, { labels: { mood: "sad" } }), names("labels/mood"));
});

test("walkers do not go back in time", async () => {
  const walkers = await model.walkers(1);
  for (const seconds of [-1 / 60, Number.NaN, Infinity])
    await assert.rejects(walkers.step(seconds), names("seconds"));
  await walkers.step(0);
  assert.equal(walkers.state(0).z, 0);
});

test("a build that cannot start tells its reason", async () => {
  const create = () => Promise.reject(new Error("fetching of the wasm failed"));
  const ort = { env: { wasm: {} }, InferenceSession: { create }, Tensor: Object };
  const broken = await load(content, { ort: ort as never });
  await assert.rejects(broken.pose(model.defaults, 0), /fetching of the wasm failed/);
});

test("a file that is no model is refused", async () => {
  await assert.rejects(load(new TextEncoder().encode("no model")), ModelError);
  await assert.rejects(load(content.subarray(0, 5000)), ModelError);
  await assert.rejects(load(new Uint8Array()), ModelError);
});
