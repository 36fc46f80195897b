/** Writes src/schema.ts from the contract: its types, and what a program needs of it as values. */

import { readFileSync, writeFileSync } from "node:fs";

import { parseYaml } from "@redocly/openapi-core";
import openapiTS, { astToString } from "openapi-typescript";

const CONTRACT = new URL("../../api/openapi.yaml", import.meta.url);
const SCHEMA = new URL("src/schema.ts", import.meta.url);
const HEAD =
  "// Generated from api/openapi.yaml by `npm run generate`: change the contract, not this.\n";

/** Documents whose keys are looked at before they are taken for what they should be. */
const LOOKED_AT = [
  "ManifestEntry",
  "ModelCard",
  "ModelList",
  "Problem",
  "Readiness",
  "Reasons",
  "SigmaGrid",
  "Trust",
];

interface Contract {
  readonly info: { readonly version: string };
  readonly components: { readonly schemas: Record<string, Schema> };
}

interface Schema {
  readonly required?: readonly string[];
  readonly properties?: { readonly type?: { readonly enum?: readonly string[] } };
}

async function source(): Promise<string> {
  const contract = parseYaml(readFileSync(CONTRACT, "utf8")) as Contract;
  const types = astToString(await openapiTS(CONTRACT, { silent: true }));
  return HEAD + types + values(contract);
}

function values({ info, components }: Contract): string {
  const required = LOOKED_AT.map((name) => [name, components.schemas[name]?.required ?? []]);
  return `/** Version of the contract that this is made from. */
export const CONTRACT = ${JSON.stringify(info.version)};

/** Keys that every document has. */
export const REQUIRED = ${text(Object.fromEntries(required))} as const;

/** Everything that may be wrong. */
export const PROBLEM_TYPES = ${text(components.schemas["Problem"]?.properties?.type?.enum)} as const;
`;
}

function text(value: unknown): string {
  return JSON.stringify(value, null, 2);
}

writeFileSync(process.argv[2] ?? SCHEMA, await source());
