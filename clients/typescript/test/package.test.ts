/** The package as it is published: plain JavaScript and types, which need nothing of the workspace. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import {
  mkdirSync,
  mkdtempSync,
  readdirSync,
  readFileSync,
  rmSync,
  symlinkSync,
  writeFileSync,
} from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";

import { CONTRACT } from "../src/index.ts";
import { URL_OF_SERVICE } from "./service.ts";

const PACKAGE = fileURLToPath(new URL("../", import.meta.url));
const MODULES = fileURLToPath(new URL("../../node_modules/", import.meta.url));
const TSC = createRequire(import.meta.url).resolve("typescript/bin/tsc");
const NEEDED = ["@msgpack", "three", "@types"];

const SCRIPT = `
import { Client, CONTRACT } from "@posefield/client";
import { skeletonOf } from "@posefield/client/three";
const client = new Client("${URL_OF_SERVICE}");
const card = await client.card("reach");
const controls = Object.fromEntries(card.controls.map((each) => [each.name, each.default]));
const { rotations } = await client.pose("reach", { controls, times: [0] });
console.log(CONTRACT, rotations.length / 4 === skeletonOf(card).bones.length);
`;

const USE = `
import { Client, type Motion, Problem, type ProblemKind } from "@posefield/client";
import { animationClip } from "@posefield/client/three";
export const clip = (motion: Motion): number => animationClip(motion).duration;
export const ask = (): Promise<Motion> => new Client().clip("reach", { controls: { stature: 1.7 } });
export const kind = (problem: Problem): ProblemKind => problem.kind;
// @ts-expect-error: a question needs controls.
export const wrong = (): Promise<Motion> => new Client().clip("reach", {});
// @ts-expect-error: no such kind.
export const never: ProblemKind = "never";
// @ts-expect-error: no such format.
export const format = (): string => new Client().url("reach", "fbx", { controls: {} });
`;

let folder: string;

before(() => {
  folder = mkdtempSync(`${tmpdir()}/posefield-`);
  run(PACKAGE, "build.ts");
  // The files that npm publishes, and no others.
  const words = ["pack", "--silent", "--pack-destination", folder];
  // It says what it has written, whose name has the version in it.
  const said = execFileSync("npm", words, { cwd: `${PACKAGE}dist`, encoding: "utf8" });
  const own = `${folder}/node_modules/@posefield/client`;
  mkdirSync(own, { recursive: true });
  const packed = `${folder}/${said.trim()}`;
  execFileSync("tar", ["-xzf", packed, "-C", own, "--strip-components=1"]);
  for (const name of NEEDED) symlinkSync(MODULES + name, `${folder}/node_modules/${name}`);
});

after(() => rmSync(folder, { recursive: true }));

function run(cwd: string, ...words: string[]): string {
  return execFileSync(process.execPath, words, { cwd, encoding: "utf8" });
}

test("npm has nothing to build, and no source to trip over", () => {
  const own = `${folder}/node_modules/@posefield/client`;
  const { scripts, exports } = JSON.parse(readFileSync(`${own}/package.json`, "utf8"));
  assert.equal(scripts, undefined);
  const files = readdirSync(own);
  assert.deepEqual(
    files.filter((name) => name.endsWith(".ts") && !name.endsWith(".d.ts")),
    [],
  );
  for (const { types, default: code } of Object.values<Record<string, string>>(exports)) {
    for (const name of [types, code]) assert.ok(files.includes(String(name).slice(2)), name);
  }
});

test("it runs where nobody knows TypeScript", () => {
  writeFileSync(`${folder}/use.mjs`, SCRIPT);
  assert.equal(run(folder, "--no-experimental-strip-types", "use.mjs"), `${CONTRACT} true\n`);
});

for (const [module, resolution] of [
  ["NodeNext", "NodeNext"],
  ["ESNext", "Bundler"],
]) {
  test(`its types hold for those who resolve as ${resolution} does`, () => {
    writeFileSync(`${folder}/package.json`, '{"type":"module"}');
    writeFileSync(`${folder}/use.ts`, USE);
    const compilerOptions = {
      module,
      moduleResolution: resolution,
      target: "ES2022",
      lib: ["ES2022", "DOM"],
      strict: true,
      noEmit: true,
      types: [],
      // Types of three.js are not ours to check.
      skipLibCheck: true,
    };
    const config = { compilerOptions, include: ["use.ts"] };
    writeFileSync(`${folder}/tsconfig.json`, JSON.stringify(config));
    try {
      run(folder, TSC, "-p", ".");
    } catch (fault) {
      assert.fail(String((fault as { stdout: unknown }).stdout));
    }
  });
}
