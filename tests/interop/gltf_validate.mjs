// What the Khronos validator says of glTF files: gltf_validate.mjs MODULES FOLDER RESULT.json
//
// For each file the result holds its errors and warnings.
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";

const [modules, folder, result] = process.argv.slice(2);
const { validateBytes } = createRequire(resolve(modules, "x.js"))("gltf-validator");
const WARNING = 1;

async function faults(path) {
  const { issues } = await validateBytes(new Uint8Array(readFileSync(path)), { maxIssues: 1 });
  const found = issues.messages.filter(({ severity }) => severity <= WARNING);
  return found.map(({ code, pointer, message }) => `${code} at ${pointer}: ${message}`);
}

const files = readdirSync(folder).filter((name) => name.endsWith(".glb")).sort();
const found = {};
for (const name of files) found[name] = await faults(join(folder, name));
writeFileSync(result, JSON.stringify(found));
