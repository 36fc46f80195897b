/** Bones of three.js stand where the service's own kinematics say that joints are. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { before, test } from "node:test";
import { AnimationMixer, type Bone, Group, Vector3 } from "three";

import {
  Client,
  type ClipQuestion,
  type CrowdPoses,
  type CrowdQuestion,
  type Motion,
} from "../src/index.ts";
import { animationClip, applyPose, nodeNames, type Rig, skeletonOf } from "../src/three.ts";
import { needed, URL_OF_SERVICE } from "./service.ts";

/** float32 over a chain of joints, m. */
const TOLERANCE = 1e-5;

interface Expected<Question> {
  readonly question: Question;
  /** Frames or characters × joints × 3, m. */
  readonly positions: number[][][];
}

interface Kinematics {
  readonly clip: Expected<ClipQuestion>;
  readonly crowd: Expected<CrowdQuestion>;
}

const client = new Client(URL_OF_SERVICE);
const path = needed("POSEFIELD_KINEMATICS");
const expected = JSON.parse(readFileSync(path, "utf8")) as Kinematics;
let motion: Motion;
let crowd: CrowdPoses;

before(async () => {
  motion = await client.clip("reach", expected.clip.question);
  crowd = await client.crowd("reach", expected.crowd.question);
});

/** Positions of bones in the world. */
function placesOf(bones: readonly Bone[]): number[][] {
  bones[0]?.updateWorldMatrix(true, true);
  return bones.map((bone) => new Vector3().setFromMatrixPosition(bone.matrixWorld).toArray());
}

/** The largest distance of a bone from where it should be, m. */
function error(bones: readonly Bone[], joints: readonly number[][]): number {
  const distances = placesOf(bones).map((place, joint) => {
    return new Vector3(...place).distanceTo(new Vector3(...joints[joint]!));
  });
  return Math.max(...distances);
}

/** The largest error over all frames of a clip that a mixer plays. */
function played(rig: Rig, shown: Motion): number {
  const mixer = new AnimationMixer(new Group().add(rig.root));
  mixer.clipAction(animationClip(shown)).play();
  // At the very end a clip that repeats has begun again.
  const frames = expected.clip.positions.slice(0, -1);
  return Math.max(
    ...frames.map((joints, frame) => {
      mixer.setTime(frame / shown.rate);
      return error(rig.bones, joints);
    }),
  );
}

test("an animation moves the bones of its own skeleton", () => {
  assert.equal(expected.clip.positions.length, motion.frames);
  assert.ok(played(skeletonOf(motion), motion) < TOLERANCE);
});

test("an animation moves the bones of the model's card, which take its lengths", async () => {
  const card = await client.card("reach");
  assert.ok(played(skeletonOf(card), motion) < TOLERANCE);
});

test("poses are put on bones, frame by frame", () => {
  const { bones } = skeletonOf(motion);
  for (const [frame, joints] of expected.clip.positions.entries()) {
    applyPose(bones, motion, frame);
    assert.ok(error(bones, joints) < TOLERANCE, `frame ${frame}`);
  }
});

test("each character of a crowd stands in the world with its own bones", () => {
  const { bones } = skeletonOf(crowd);
  for (const [character, joints] of expected.crowd.positions.entries()) {
    applyPose(bones, crowd, character);
    assert.ok(error(bones, joints) < TOLERANCE, `character ${character}`);
  }
});

test("quaternions in another order, other bones or another frame would be noticed", () => {
  const turned = Float32Array.from(motion.rotations, (_, at) => motion.rotations[at ^ 1]!);
  assert.ok(played(skeletonOf(motion), { ...motion, rotations: turned }) > 0.01);
  const longer = motion.boneOffsets.map((length) => 1.001 * length);
  assert.ok(played(skeletonOf(motion), { ...motion, boneOffsets: longer }) > 10 * TOLERANCE);
  const { bones } = skeletonOf(motion);
  applyPose(bones, motion, 0);
  assert.ok(error(bones, expected.clip.positions.at(-1)!) > 10 * TOLERANCE);
});

test("a skeleton is bound as it stands, and has a bone for each joint", async () => {
  const { skeleton: joints } = await client.card("reach");
  const { root, bones, skeleton } = skeletonOf(await client.card("reach"));
  assert.equal(bones[0], root);
  assert.deepEqual(
    bones.map((bone) => bone.userData["joint"]),
    joints.names,
  );
  assert.deepEqual(
    bones.map((bone) => bones.indexOf(bone.parent as Bone)),
    joints.parents,
  );
  root.updateMatrixWorld(true);
  assert.ok(placesOf(bones).some(([, height]) => height! > 0.1));
  for (const [index, bone] of bones.entries()) {
    const unmoved = bone.matrixWorld.clone().multiply(skeleton.boneInverses[index]!);
    assert.ok(unmoved.elements.every((value, at) => Math.abs(value - (at % 5 ? 0 : 1)) < 1e-6));
  }
});

test("a clip is as long as its frames", () => {
  const { duration, tracks } = animationClip(motion, "reaching");
  assert.ok(Math.abs(duration - motion.times.at(-1)!) < 1e-6);
  assert.ok(tracks.every((track) => track.times.every((time) => time <= duration + 1e-6)));
});

test("a loop ends in the pose that it begins with", async () => {
  const { controls } = await client.card("walk");
  const question = {
    controls: Object.fromEntries(controls.map((control) => [control.name, control.default])),
    loop: true,
    root: "in_place",
  } as const;
  const walk = await client.clip("walk", question);
  const rig = skeletonOf(walk);
  const mixer = new AnimationMixer(rig.root);
  const clip = animationClip(walk);
  mixer.clipAction(clip).play();
  const at = (cycles: number) => {
    mixer.setTime(cycles * clip.duration);
    return placesOf(rig.bones);
  };
  for (const [cycles, same] of [
    [3.4, 0.4],
    [0.999999, 0],
    [1, 0],
  ] as const) {
    const places = at(cycles);
    at(same);
    assert.ok(error(rig.bones, places) < TOLERANCE, `${cycles} and ${same} cycles`);
    at(0.7);
    assert.ok(error(rig.bones, places) > 100 * TOLERANCE, `${cycles} and 0.7 cycles`);
  }
});

test("names become those that three.js can find, each its own", () => {
  assert.deepEqual(nodeNames(["rig:Hips", "rig.Hips", "Left Arm", "a[0]/b", "::", "rigHips_2"]), [
    "rigHips",
    "rigHips_2",
    "Left_Arm",
    "a0b",
    "joint",
    "rigHips_2_2",
  ]);
});

test("an animation finds bones by names that three.js would not take", () => {
  const names = motion.names.map((name) => `rig:${name}.x`);
  const renamed = { ...motion, names };
  assert.ok(played(skeletonOf(renamed), renamed) < TOLERANCE);
});
