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
  "Suggestions",
  "Trust",
];

/** Paths of files; their endings are the formats that one asks for by name. */
const FILES = /^\/v1\/models\/\{model\}\/(?:clips?|crowd)\.(\w+)$/;
const RESPONSES = "#/components/responses/";

interface Contract {
  readonly info: { readonly version: string };
  readonly paths: Record<string, Record<"get" | "post", Operation | undefined>>;
  readonly components: {
    readonly schemas: Record<string, Schema>;
    readonly responses: Record<string, { readonly content?: object }>;
  };
}

interface Operation {
  readonly responses: Record<"200", { readonly $ref?: string }>;
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

/** Which of them are lists. */
export const LISTS = ${text(Object.fromEntries(lists))} as const;

/** What files of each format are sent as. */
export const MEDIA_TYPES = ${text(mediaTypes(contract))} as const;

/** Everything that may be wrong. */
export const PROBLEM_TYPES = ${text(components.schemas["Problem"]?.properties?.["type"]?.enum)} as const;
`;
}

function listsOf({ required = [], properties = {} }: Schema): readonly string[] {
  return required.filter((key) => properties[key]?.type === "array");
}

function mediaTypes({ paths, components }: Contract): object {
  const found: Record<string, string | undefined> = {};
  for (const [path, { get, post }] of Object.entries(paths)) {
    const [, format] = FILES.exec(path) ?? [];
    const named = (get ?? post)?.responses[200].$ref?.slice(RESPONSES.length) ?? "";
    if (format) found[format] = Object.keys(components.responses[named]?.content ?? {})[0];
  }
  return found;
}

function text(value: unknown): string {
  return JSON.stringify(value, null, 2);
}

writeFileSync(process.argv[2] ?? SCHEMA, await source());
