/** The examples of the README run as they stand, one after another. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

import { URL_OF_SERVICE } from "./service.ts";

const PACKAGE = fileURLToPath(new URL("../", import.meta.url));

function examples(): string {
  const text = readFileSync(`${PACKAGE}README.md`, "utf8");
  const blocks = [...text.matchAll(/^```js\n(.*?)^```$/gms)].map((found) => found[1]);
  assert.ok(blocks.length >= 6);
  return blocks
    .join("\n")
    .replaceAll("http://localhost:8000", URL_OF_SERVICE)
    .replaceAll('"hdm05_grab_high"', '"reach"');
}

test("the examples of the README run", () => {
  // Within the package, whose name then stands for itself.
  mkdirSync(`${PACKAGE}.tmp`, { recursive: true });
  const folder = mkdtempSync(`${PACKAGE}.tmp/readme-`);
  try {
    writeFileSync(`${folder}/readme.mjs`, examples());
    const said = execFileSync(process.execPath, ["readme.mjs"], { cwd: folder, encoding: "utf8" });
    assert.match(said, /^\d+ frames of \d+ joints, sigma 0\.\d+ m$/m);
    assert.match(said, /^times? .*expected 0 to/m);
    assert.match(said, /^\d+ frames, 1 join$/m);
    assert.match(said, /^performance\.glb has \d+ bytes$/m);
    assert.ok(statSync(`${folder}/reach.tar`).size > 1024);
  } finally {
    rmSync(folder, { recursive: true });
  }
});
