import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { defineConfig, type Plugin } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

const file = (path: string) => fileURLToPath(new URL(path, import.meta.url));
const SWAGGER = file("../node_modules/swagger-ui/dist/swagger-ui-es-bundle-core.js");

/** Parts that Swagger UI imports and this page replaces: see docs/decisions/0050-slim-swagger-ui.md. */
const REPLACED: readonly (readonly [RegExp, string])[] = [
  [/^swagger-client\/es\/resolver\/strategies\/openapi-3-1-apidom$/, file("src/resolver.ts")],
  [/^react-syntax-highlighter\//, file("src/plain-code.ts")],
];

function replacements(): Plugin {
  return {
    name: "posefield-replacements",
    enforce: "pre",
    resolveId(source, importer) {
      if (source === "swagger-ui") return SWAGGER;
      if (importer !== SWAGGER) return null;
      return REPLACED.find(([found]) => found.test(source))?.[1] ?? null;
    },
  };
}

/** The licences of the packages in the page, which have to go with it. */
function licences(): Plugin {
  const packages = new Set<string>();
  return {
    name: "posefield-licences",
    moduleParsed({ id }) {
      const found = id.match(/^\0?(.*\/node_modules\/(?:@[^/]+\/)?[^/]+)\//);
      if (found) packages.add(found[1]!);
    },
    writeBundle({ dir }) {
      const texts = [...packages].sort().map(licence);
      writeFileSync(`${dir}/LICENSES.txt`, texts.join("\n\n"));
    },
  };
}

/** The name of a package and the licence files in its folder. */
function licence(folder: string): string {
  const about = JSON.parse(readFileSync(join(folder, "package.json"), "utf8")) as Package;
  const names = readdirSync(folder, { withFileTypes: true })
    .filter((entry) => entry.isFile() && /^(licen[cs]e|notice)/i.test(entry.name))
    .map(({ name }) => name);
  const texts = names.map((name) => readFileSync(join(folder, name), "utf8").trim());
  if (!about.license) throw new Error(`${folder}: its package.json names no licence`);
  return [`## ${about.name} ${about.version}, ${about.license}`, ...texts].join("\n\n");
}

interface Package {
  readonly name: string;
  readonly version: string;
  readonly license?: string;
}

// One file, the service's answer to `/docs`: see service/posefield/http/pages/static_page.py.
export default defineConfig({
  plugins: [replacements(), viteSingleFile({ removeViteModuleLoader: true }), licences()],
  build: {
    outDir: "../../service/posefield/http/pages/docs",
    emptyOutDir: true,
    modulePreload: false,
  },
  server: { proxy: { "/v1": "http://127.0.0.1:8000", "/openapi.json": "http://127.0.0.1:8000" } },
});
