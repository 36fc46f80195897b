/** Walkers that are steered: feet stand, speed follows at once, walks begin and end. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { InvalidField, load, type Steering, type Walkers } from "../src/index.ts";
import { LimbPoses } from "../src/limbs.ts";
import { norm, subtract, type Vector } from "../src/vectors.ts";

const SHIPPED = new URL("../../../service/posefield/shipped/", import.meta.url);
const STEP = 1 / 60;
/** Largest mean speed of standing feet, m/s, and of any joint. */
const SKATE = 0.01;
const FASTEST = 8;

async function walkers(name: string, count = 1): Promise<Walkers> {
  const model = await load(readFileSync(new URL(`${name}.onnx`, SHIPPED)));
  return model.walkers(count);
}

/** Places of all joints of the first walker, m. */
function joints({ poses }: Walkers): Vector[] {
  const { parents, rotations, rootPosition, boneOffsets } = poses;
  const all = parents.map((_, joint) => joint);
  const local = { frames: 1, rotations, roots: rootPosition, bones: boneOffsets };
  const placed = new LimbPoses(parents, all, local);
  return all.map((joint) => placed.position(joint, 0));
}

/** Stand, walk, turn, walk slowly, stop, turn on the spot and walk fast. */
function script(seconds: number, fast: number): Steering {
  if (seconds < 0.5 || (seconds > 8 && seconds < 10)) return { speed: 0, turn: 0 };
  if (seconds < 3) return { speed: 0.8 * fast, turn: 0 };
  if (seconds < 6) return { speed: 0.8 * fast, turn: 0.8 };
  if (seconds < 8) return { speed: 0.45 * fast, turn: -0.8 };
  if (seconds < 12) return { speed: 0, turn: 1.2 };
  return { speed: fast, turn: 0 };
}

for (const name of ["cmu_walk", "hdm05_sneak"])
  test(`the feet of ${name} stand while it is steered`, async (context) => {
    const walk = await walkers(name);
    const [, fast] = walk.speeds;
    let before = joints(walk);
    let standing = walk.standing(0);
    const slides: number[] = [];
    let fastest = 0;
    for (let frame = 0; frame < 14 / STEP; frame++) {
      walk.steer(0, script(frame * STEP, fast));
      await walk.step(STEP);
      const after = joints(walk);
      const now = walk.standing(0);
      for (const [foot, tip] of [5, 10].entries()) {
        const [x, , z] = subtract(after[tip]!, before[tip]!);
        if (standing[foot] && now[foot]) slides.push(Math.hypot(x, z) / STEP);
      }
      const speeds = after.map((place, joint) => norm(subtract(place, before[joint]!)) / STEP);
      fastest = Math.max(fastest, ...speeds);
      [before, standing] = [after, now];
    }
    const skate = slides.reduce((sum, speed) => sum + speed, 0) / slides.length;
    context.diagnostic(
      `skate ${(100 * skate).toFixed(3)} cm/s, fastest joint ${fastest.toFixed(1)} m/s`,
    );
    assert.ok(slides.length > 600 && skate < SKATE, `feet slide at ${skate} m/s`);
    assert.ok(fastest > 1 && fastest < FASTEST, `a joint moves at ${fastest} m/s`);
  });

test("another speed acts in the next frame, and is reached within a step", async () => {
  const walk = await walkers("cmu_walk");
  walk.steer(0, { speed: 0.7, turn: 0 });
  for (let frame = 0; frame < 90; frame++) await walk.step(STEP);
  assert.ok(Math.abs(walk.state(0).speed - 0.7) < 1e-9);
  walk.steer(0, { speed: 1.5, turn: 0 });
  await walk.step(STEP);
  assert.ok(walk.state(0).speed > 0.73);
  for (let frame = 0; frame < 24; frame++) await walk.step(STEP);
  assert.ok(Math.abs(walk.state(0).speed - 1.5) < 1e-9);
});

test("a walker that stops stands with both feet below its hips", async () => {
  const walk = await walkers("cmu_walk");
  walk.put(0, [2, -1], 0.5);
  for (let frame = 0; frame < 100; frame++) {
    walk.steer(0, { speed: frame < 40 ? 1.2 : 0, turn: 0 });
    await walk.step(STEP);
  }
  for (let frame = 0; frame < 90; frame++) await walk.step(STEP);
  const before = joints(walk);
  await walk.step(STEP);
  const after = joints(walk);
  const moved = after.map((place, joint) => norm(subtract(place, before[joint]!)));
  assert.ok(Math.max(...moved) < 1e-3);
  assert.deepEqual(walk.standing(0), [true, true]);
  for (const tip of [5, 10]) {
    const [x, , z] = subtract(after[tip]!, after[0]!);
    assert.ok(Math.hypot(x, z) < 0.25, `${x} ${z}`);
  }
});

test("a walker reaches the point that it is sent to", async () => {
  const walk = await walkers("cmu_walk", 2);
  let distance = Number.POSITIVE_INFINITY;
  for (let frame = 0; frame < 600; frame++) {
    distance = walk.steerTo(1, [-2, 3], 1.2);
    await walk.step(STEP);
  }
  assert.ok(distance < 0.4, `${distance} m`);
  assert.equal(walk.state(0).speed, 0);
});

test("a model that is no walk has no walkers, and steering is a number", async () => {
  await assert.rejects(walkers("hdm05_kick"), InvalidField);
  const walk = await walkers("cmu_walk");
  assert.throws(() => walk.steer(0, { speed: Number.NaN, turn: 0 }), InvalidField);
});
