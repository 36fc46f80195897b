/**
 * Writes dist: the package of this folder as it is published (`npm publish dist`), JavaScript and its types.
 *
 * In the workspace `exports` name the sources, which npm would publish as they are. A package that
 * compiles sources of the client beside its own has them inside, and needs no client.
 */

import { execFileSync } from "node:child_process";
import {
  copyFileSync,
  existsSync,
  readdirSync,
  readFileSync,
  rmSync,
  writeFileSync,
} from "node:fs";
import { createRequire } from "node:module";
import { basename } from "node:path";
import { pathToFileURL } from "node:url";

const HERE = pathToFileURL(`${process.cwd()}/`);
const DIST = new URL("dist/", HERE);
const NESTED = `${basename(process.cwd())}/src/`;
const TSC = createRequire(import.meta.url).resolve("typescript/bin/tsc");

function published(folder: string): object {
  const own = described(new URL("package.json", HERE));
  const { private: _, scripts: __, devDependencies: ___, ...kept } = own;
  const { "@posefield/client": ____, ...dependencies } = kept.dependencies;
  return {
    ...kept,
    dependencies,
    exports: { ".": entry(`${folder}index`), "./three": entry(`${folder}three`) },
  };
}

interface Description extends Readonly<Record<string, unknown>> {
  readonly dependencies: Readonly<Record<string, string>>;
}

function described(path: URL): Description {
  const found: unknown = JSON.parse(readFileSync(path, "utf8"));
  if (typeof found === "object" && found && "dependencies" in found) return found as Description;
  throw new Error(`${path.pathname} describes no package with dependencies`);
}

function entry(path: string): object {
  return { types: `./${path}.d.ts`, default: `./${path}.js` };
}

/** Let the compiled files of a folder import the client's, which lie beside them. */
function joinClient(folder: URL): void {
  for (const name of readdirSync(folder)) {
    const file = new URL(name, folder);
    const text = readFileSync(file, "utf8");
    writeFileSync(
      file,
      text.replaceAll(/"@posefield\/client\/(\w+)"/g, '"../../typescript/src/$1.js"'),
    );
  }
}

rmSync(DIST, { recursive: true, force: true });
execFileSync(process.execPath, [TSC, "-p", "tsconfig.build.json"], { cwd: HERE, stdio: "inherit" });
const nested = existsSync(new URL(NESTED, DIST));
if (nested) joinClient(new URL(NESTED, DIST));
writeFileSync(
  new URL("package.json", DIST),
  `${JSON.stringify(published(nested ? NESTED : ""), null, 2)}\n`,
);
copyFileSync(new URL("README.md", HERE), new URL("README.md", DIST));
copyFileSync(new URL("../../LICENSE", HERE), new URL("LICENSE", DIST));
