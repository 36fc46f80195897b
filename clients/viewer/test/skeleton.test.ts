/** Joints in space, against three's own matrices. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Object3D, Quaternion, Vector3 } from "three";

import { place, placed } from "../src/skeleton.ts";
import { noise } from "./noise.ts";

const PARENTS = [-1, 0, 1, 2, 0, 4, 4];

/** One frame of random rotations, and where three has the joints. */
function example(order: (q: Quaternion, turn: Quaternion) => Quaternion) {
  const random = noise(7);
  const offsets = Float32Array.from({ length: 3 * PARENTS.length }, () => random() - 0.5);
  const rotations = new Float32Array(4 * PARENTS.length);
  const roots = Float32Array.of(0.3, 1, -0.2);
  const joints = PARENTS.map(() => new Object3D());
  PARENTS.forEach((parent, at) => {
    const q = new Quaternion(random() - 0.5, random() - 0.5, random() - 0.5, random() - 0.5);
    q.normalize();
    rotations.set([q.w, q.x, q.y, q.z], 4 * at);
    joints[at]!.quaternion.copy(order(q.clone(), q));
    joints[at]!.position.fromArray(parent < 0 ? roots : offsets, parent < 0 ? 0 : 3 * at);
    if (parent >= 0) joints[parent]!.add(joints[at]!);
  });
  joints[0]!.updateMatrixWorld();
  const found = place(placed(PARENTS.length), PARENTS, offsets, rotations, roots, 0);
  const expected = joints.flatMap((joint) => joint.getWorldPosition(new Vector3()).toArray());
  return Math.max(...expected.map((x, i) => Math.abs(x - found.positions[i]!)));
}

test("joints are where three has them", () => {
  assert.ok(example((q) => q) < 1e-6);
});

test("… and would not be, were rotations turned the other way", () => {
  assert.ok(example((q) => q.conjugate()) > 0.1);
});
