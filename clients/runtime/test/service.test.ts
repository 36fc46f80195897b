/** Answers of the run time in Node against the service's; POSEFIELD_ANSWERS names their file. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { differences, type ModelAnswers } from "./answers.ts";

const FILE = process.env["POSEFIELD_ANSWERS"];
const MODELS: readonly ModelAnswers[] = FILE ? JSON.parse(readFileSync(FILE, "utf8")) : [];
const POSE_LIMIT = 1e-5;
const CLIP_LIMIT = 1e-4;

for (const answers of MODELS)
  test(`${answers.file.split("/").at(-1)} gives the service's answers`, async (context) => {
    const { pose, clip } = await differences(readFileSync(answers.file), answers);
    assert.ok(pose < POSE_LIMIT, `poses differ by ${pose}`);
    assert.ok(clip < CLIP_LIMIT, `joints of clips differ by ${clip} m`);
    context.diagnostic(`poses differ by ${pose.toExponential(1)}, clips by ${1e3 * clip} mm`);
  });

test("another pose is told apart", { skip: !MODELS.length }, async () => {
  const answers = MODELS.find(({ file }) => file.endsWith("cmu_walk.onnx"))!;
  const [first, second] = answers.poses;
  const clips = [{ ...answers.clips[0]!, options: { fps: 60, feet: "as_predicted" } as const }];
  const swapped = { ...answers, poses: [{ ...second!, controls: first!.controls }], clips };
  const { pose, clip } = await differences(readFileSync(answers.file), swapped);
  assert.ok(pose > POSE_LIMIT && clip > CLIP_LIMIT);
});
