/** The examples of the README run with the package that is published, in plain JavaScript. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import {
  copyFileSync,
  cpSync,
  mkdtempSync,
  readFileSync,
  rmSync,
  symlinkSync,
  writeFileSync,
} from "node:fs";
import { tmpdir } from "node:os";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

const PACKAGE = fileURLToPath(new URL("../", import.meta.url));
const MODULES = fileURLToPath(new URL("../../node_modules/", import.meta.url));
const SHIPPED = fileURLToPath(new URL("../../../service/posefield/shipped/", import.meta.url));

test("the examples of the README run", () => {
  const text = readFileSync(`${PACKAGE}README.md`, "utf8");
  const blocks = [...text.matchAll(/^```js\n(.*?)^```$/gms)].map((block) => block[1]);
  const folder = mkdtempSync(`${tmpdir()}/posefield-`);
  try {
    execFileSync(process.execPath, ["../typescript/build.ts"], { cwd: PACKAGE });
    cpSync(`${PACKAGE}dist`, `${folder}/node_modules/@posefield/runtime`, { recursive: true });
    for (const name of ["onnxruntime-web", "three"])
      symlinkSync(MODULES + name, `${folder}/node_modules/${name}`);
    copyFileSync(`${SHIPPED}cmu_walk.onnx`, `${folder}/cmu_walk.onnx`);
    writeFileSync(`${folder}/readme.mjs`, blocks.join("\n"));
    const said = execFileSync(process.execPath, ["--no-experimental-strip-types", "readme.mjs"], {
      cwd: folder,
      encoding: "utf8",
    });
    assert.match(said, /^31 joints in two poses, sigma 0\.0\d+ m$/m);
    assert.match(said, /^at -?0\.\d, 0\.\d m, 1\.2 m\/s$/m);
    assert.match(said, /^\d\d frames, [234] stances of feet that stand$/m);
  } finally {
    rmSync(folder, { recursive: true });
  }
});
