/** The examples of the README run as they stand. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

const PACKAGE = fileURLToPath(new URL("../", import.meta.url));
const SHIPPED = fileURLToPath(new URL("../../../service/posefield/shipped/", import.meta.url));

test("the examples of the README run", () => {
  const text = readFileSync(`${PACKAGE}README.md`, "utf8");
  const blocks = [...text.matchAll(/^```js\n(.*?)^```$/gms)].map((block) => block[1]);
  // Within the package, whose name then stands for itself.
  mkdirSync(`${PACKAGE}.tmp`, { recursive: true });
  const folder = mkdtempSync(`${PACKAGE}.tmp/readme-`);
  try {
    copyFileSync(`${SHIPPED}cmu_walk.onnx`, `${folder}/cmu_walk.onnx`);
    writeFileSync(`${folder}/readme.mjs`, blocks.join("\n"));
    const said = execFileSync(process.execPath, ["readme.mjs"], { cwd: folder, encoding: "utf8" });
    assert.match(said, /^31 joints in two poses, sigma 0\.0\d+ m$/m);
    assert.match(said, /^at -?0\.\d, 0\.\d m, 1\.2 m\/s$/m);
    assert.match(said, /^\d\d frames, [234] stances of feet that stand$/m);
  } finally {
    rmSync(folder, { recursive: true });
  }
});
