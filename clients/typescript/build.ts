/**
 * Writes dist: the package as it is published (`npm publish dist`), JavaScript and its types.
 *
 * In the workspace `exports` name the sources, which npm would publish as they are.
 */

import { execFileSync } from "node:child_process";
import { copyFileSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";

const HERE = new URL("./", import.meta.url);
const DIST = new URL("dist/", HERE);
const TSC = createRequire(import.meta.url).resolve("typescript/bin/tsc");

function published(): object {
  const own = described(new URL("package.json", HERE));
  const { private: _, scripts: __, devDependencies: ___, ...kept } = own;
  return { ...kept, exports: { ".": entry("index"), "./three": entry("three") } };
}

function described(path: URL): Readonly<Record<string, unknown>> {
  const found: unknown = JSON.parse(readFileSync(path, "utf8"));
  if (typeof found === "object" && found && "dependencies" in found) return { ...found };
  throw new Error(`${path.pathname} describes no package with dependencies`);
}

function entry(name: string): object {
  return { types: `./${name}.d.ts`, default: `./${name}.js` };
}

rmSync(DIST, { recursive: true, force: true });
execFileSync(process.execPath, [TSC, "-p", "tsconfig.build.json"], { cwd: HERE, stdio: "inherit" });
writeFileSync(new URL("package.json", DIST), `${JSON.stringify(published(), null, 2)}\n`);
copyFileSync(new URL("README.md", HERE), new URL("README.md", DIST));
copyFileSync(new URL("../../LICENSE", HERE), new URL("LICENSE", DIST));
