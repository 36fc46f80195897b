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
  "CharacterList",
  "ModelCard",
  "ModelList",
  "PerformanceReport",
  "Problem",
  "Readiness",
  "Reasons",
  "SigmaGrid",
  "Suggestions",
  "Trust",
];

interface Contract {
  readonly info: { readonly version: string };
  readonly components: {
    readonly schemas: Record<string, Schema>;
    readonly parameters: Record<string, Parameter>;
  };
}

interface Parameter {
  readonly "x-media-types"?: object;
}

interface Schema {
  readonly required?: readonly string[];
  readonly properties?: Record<string, { readonly type?: unknown; readonly enum?: unknown }>;
}

async function source(): Promise<string> {
  const contract = parseYaml(readFileSync(CONTRACT, "utf8")) as Contract;
  const types = astToString(await openapiTS(CONTRACT, { silent: true }));
  return HEAD + types + values(contract);
}

function values(contract: Contract): string {
  const { info, components } = contract;
  const required = LOOKED_AT.map((name) => [name, components.schemas[name]?.required ?? []]);
  const lists = LOOKED_AT.map((name) => [name, listsOf(components.schemas[name] ?? {})]);
  return `/** Version of the contract that this is made from. */
export const CONTRACT = ${JSON.stringify(info.version)};

/** Keys that every document has. */
export const REQUIRED = ${text(Object.fromEntries(required))} as const;

/** Parameters that are lists. */
export const LISTS = ${text(Object.fromEntries(lists))} as const;

/** Media types of the files of each format. */
export const MEDIA_TYPES = ${text(mediaTypes(contract))} as const;

/** Everything that may be wrong. */
export const PROBLEM_TYPES = ${text(components.schemas["Problem"]?.properties?.["type"]?.enum)} as const;
`;
}

function listsOf({ required = [], properties = {} }: Schema): readonly string[] {
  return required.filter((key) => properties[key]?.type === "array");
}

/** Media types of all formats that may end a path. */
function mediaTypes({ components }: Contract): object {
  const formats = Object.values(components.parameters).map((each) => each["x-media-types"] ?? {});
  return Object.assign({}, ...formats) as object;
}

function text(value: unknown): string {
  return JSON.stringify(value, null, 2);
}

writeFileSync(process.argv[2] ?? SCHEMA, await source());
