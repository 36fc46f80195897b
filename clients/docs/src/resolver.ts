/** Resolver of references for Swagger UI, whose own for OpenAPI 3.1 weighs half of its bundle.
 *
 * It resolves references within one document, and our contract has no others.
 */

import type { Json, JsonObject } from "./document.ts";

interface Options {
  readonly spec: JsonObject;
  readonly pathDiscriminator?: readonly string[];
}

/** The form of swagger-client's strategies. */
const strategy = {
  name: "openapi-3-1",
  match: (spec: JsonObject) => String(spec["openapi"]).startsWith("3.1"),
  normalize: (spec: JsonObject) => spec,
  /** Resolve the references below a path; the rest of the document stays as it is. */
  resolve: async ({ spec, pathDiscriminator = [] }: Options) => ({
    spec: replaced(spec, pathDiscriminator, (part) => resolved(spec, part, [])),
    errors: [],
  }),
};
export default strategy;

function replaced(node: Json, path: readonly string[], change: (part: Json) => Json): JsonObject {
  const [key, ...rest] = path;
  if (key === undefined) return change(node) as JsonObject;
  const copy = (Array.isArray(node) ? [...node] : { ...(node as JsonObject) }) as JsonObject;
  copy[key] = rest.length ? replaced(copy[key]!, rest, change) : change(copy[key]!);
  return copy;
}

/**
 * Return a node with its references replaced. A reference to what it stands in stays a reference.
 *
 * within: the references that lead to this node.
 */
export function resolved(document: JsonObject, node: Json, within: readonly string[]): Json {
  if (Array.isArray(node)) return node.map((each) => resolved(document, each, within));
  if (node === null || typeof node !== "object") return node;
  const { $ref, ...own } = node;
  if (typeof $ref === "string") {
    if (within.includes($ref)) return node;
    const target = resolved(document, found(document, $ref), [...within, $ref]) as JsonObject;
    return { ...target, ...(resolved(document, own, within) as JsonObject) };
  }
  const entries = Object.entries(node).map(
    ([key, value]) => [key, resolved(document, value, within)] as const,
  );
  return Object.fromEntries(entries);
}

/** Return what a reference into the document names. */
export function found(document: JsonObject, reference: string): Json {
  const parts = reference.replace(/^#\//, "").split("/");
  const names = parts.map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
  return names.reduce((node: Json, name) => (node as JsonObject)[name]!, document);
}
