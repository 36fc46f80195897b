/** Time that goes on, and poses between frames. */

import assert from "node:assert/strict";
import { test } from "node:test";

import type { Motion } from "@posefield/client";
import { Quaternion } from "three";

import { advanced, after, carried, NOWHERE, pose, sample, turned } from "../src/playback.ts";
import { noise } from "./noise.ts";

test("time goes on, begins again, or stops", () => {
  assert.deepEqual(advanced(0.5, 0.1, 1, true), { time: 0.6, playing: true, laps: 0 });
  const again = advanced(0.9, 2.2, 1, true);
  assert.ok(Math.abs(again.time - 0.1) < 1e-9);
  assert.deepEqual([again.playing, again.laps], [true, 3]);
  assert.deepEqual(advanced(0.9, 0.2, 1, false), { time: 1, playing: false, laps: 0 });
});

test("a minute of frames ends where a minute ends", () => {
  let time = 0;
  let laps = 0;
  for (let frame = 0; frame < 3600; frame++) {
    const next = advanced(time, 1 / 60, 1.13, true);
    time = next.time;
    laps += next.laps;
  }
  assert.ok(Math.abs(laps * 1.13 + time - 60) < 1e-9);
});

/** Three frames of two joints, at 10 a second. */
function clip(): Motion {
  const random = noise(3);
  const turns = Array.from({ length: 6 }, () =>
    new Quaternion(random() - 0.5, random() - 0.5, random() - 0.5, random() - 0.5).normalize(),
  );
  return {
    times: Float64Array.of(0, 0.1, 0.2),
    rate: 10,
    frames: 3,
    rotations: Float32Array.from(turns.flatMap(({ w, x, y, z }) => [w, x, y, z])),
    rootPosition: Float32Array.of(0, 1, 0, 0.1, 1, 0.2, 0.3, 1.1, 0.4),
  } as unknown as Motion;
}

test("between frames rotations are three's slerp, at frames the frames", () => {
  const of = clip();
  for (const [time, first, share] of [
    [0.03, 0, 0.3],
    [0.1, 1, 0],
    [0.17, 1, 0.7],
    [9, 1, 1],
  ] as const) {
    const found = sample(pose(2), of, time);
    for (const joint of [0, 1]) {
      const [a, b] = [at(of, first, joint), at(of, first + 1, joint)];
      const expected = a.slerp(b, share);
      const [w, x, y, z] = found.rotations.subarray(4 * joint, 4 * joint + 4);
      assert.ok(expected.angleTo(new Quaternion(x, y, z, w)) < 1e-3);
      assert.ok(expected.angleTo(at(of, 0, 1 - joint)) > 0.1, "another joint would be noticed");
    }
    assert.ok(Math.abs(Math.hypot(...found.rotations.subarray(0, 4)) - 1) < 1e-6);
  }
});

function at(of: Motion, frame: number, joint: number): Quaternion {
  const [w, x, y, z] = of.rotations.subarray(8 * frame + 4 * joint, 8 * frame + 4 * joint + 4);
  return new Quaternion(x, y, z, w);
}

test("a cycle's last frame, carried, is the next cycle's first", () => {
  const turn = 0.4;
  const half = [Math.cos(turn / 2), 0, Math.sin(turn / 2), 0];
  const of = {
    times: Float64Array.of(0, 1),
    rotations: Float32Array.of(1, 0, 0, 0, ...half),
    rootPosition: Float32Array.of(0.1, 1, 0, 0.3, 1, 1.4),
  } as unknown as Motion;
  const lap = carried(of, 1);
  assert.ok(Math.abs(lap.turn - turn) < 1e-6);
  const [x, z] = turned(0.1, 0, lap.turn);
  assert.ok(Math.hypot(x + lap.x - 0.3, z + lap.z - 1.4) < 1e-6);
  const [wrong] = turned(0.1, 0, -lap.turn);
  assert.ok(
    Math.abs(turned(0.1, 0, lap.turn)[1] - turned(0.1, 0, -lap.turn)[1]) > 0.05,
    `${wrong}`,
  );
});

test("laps add up as one way after the other", () => {
  const quarter = { turn: Math.PI / 2, x: 0, z: 1 };
  let place = NOWHERE;
  for (let lap = 0; lap < 4; lap++) place = after(place, quarter);
  assert.ok(Math.hypot(place.x, place.z) < 1e-9);
  const two = after(quarter, quarter);
  assert.ok(Math.hypot(two.x - 1, two.z - 1) < 1e-9);
});
