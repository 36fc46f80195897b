/** Answers of the run time in Node against the service's; POSEFIELD_ANSWERS names their file. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { differences, type ModelAnswers } from "./answers.ts";

const FILE = process.env["POSEFIELD_ANSWERS"];
const MODELS: readonly ModelAnswers[] = FILE ? JSON.parse(readFileSync(FILE, "utf8")) : [];
const POSE_LIMIT = 1e-5;

for (const answers of MODELS)
  test(`${answers.file.split("/").at(-1)} gives the service's poses`, async () => {
    const { pose } = await differences(readFileSync(answers.file), answers);
    assert.ok(pose < POSE_LIMIT, `poses differ by ${pose}`);
  });

test("another pose is told apart", { skip: !MODELS.length }, async () => {
  const answers = MODELS[0]!;
  const [first, second] = answers.poses;
  const swapped = { ...answers, poses: [{ ...second!, controls: first!.controls }] };
  assert.ok((await differences(readFileSync(answers.file), swapped)).pose > POSE_LIMIT);
});
