/** The contract with examples that the loaded models answer, for "Try it out". */

export type Json = null | boolean | number | string | Json[] | JsonObject;
export interface JsonObject {
  [name: string]: Json;
}

export interface Control {
  readonly name: string;
  readonly default: number;
}

/** A loaded model, as its card describes it. */
export interface Model {
  readonly name: string;
  readonly controls: readonly Control[];
  readonly cyclic?: boolean;
}

type Values = Readonly<Record<string, Json>>;

/**
 * Return the contract with the model's name and controls in every example. Optional parameters lose
 * their examples, because Swagger UI sends each parameter that has one.
 */
export function withExamples(contract: JsonObject, model: Model | undefined): JsonObject {
  const document = structuredClone(contract);
  moveParameters(document);
  const { parameters, requestBodies } = document["components"] as Record<string, JsonObject>;
  const values = model ? valuesOf(model) : {};
  for (const [key, parameter] of Object.entries(parameters ?? {}))
    fillParameter(document, key, parameter as JsonObject, values);
  const bodies = Object.values(requestBodies ?? {}) as JsonObject[];
  for (const item of Object.values(document["paths"] as JsonObject) as JsonObject[]) {
    const operation = item["post"] as JsonObject | undefined;
    if (operation?.["requestBody"]) bodies.push(operation["requestBody"] as JsonObject);
  }
  for (const body of bodies) fillBody(document, body, values);
  return document;
}

/** Move the parameters that a path's operations share into each operation. */
function moveParameters(document: JsonObject): void {
  for (const item of Object.values(document["paths"] as JsonObject) as JsonObject[]) {
    const { parameters = [] } = item;
    delete item["parameters"];
    for (const operation of [item["get"], item["post"]] as (JsonObject | undefined)[])
      if (operation)
        operation["parameters"] = [
          ...(parameters as Json[]),
          ...((operation["parameters"] ?? []) as Json[]),
        ];
  }
}

/** Fold what follows the first paragraph of the contract's description, before the operations. */
export function foldDescription(document: JsonObject): void {
  const info = document["info"] as JsonObject;
  const [first, ...rest] = String(info["description"] ?? "").split(/\n\s*\n/);
  if (!rest.length) return;
  const conventions = `<details><summary>Conventions: units, formats, errors, caching, keys</summary>\n\n${rest.join("\n\n")}\n\n</details>`;
  info["description"] = `${first}\n\n${conventions}`;
}

/** Values of parameters and properties by name: the smallest question that the model answers. */
function valuesOf({ name, controls, cyclic = false }: Model): Values {
  const given = Object.fromEntries(controls.map((control) => [control.name, control.default]));
  const [across, along] = controls.map((control) => control.name);
  const segments = cyclic
    ? [{ kind: "walk", model: name, seconds: 2 }]
    : [{ kind: "act", model: name, controls: given }];
  return {
    model: name,
    controls: given,
    time: [0],
    times: [0],
    clips: [{ name: "first", controls: given }],
    segments,
    scripts: [{ name: "first", segments }],
    ...(across && along ? { across, along } : {}),
  };
}

/** key: the parameter's name among the components; two kinds of controls have one name. */
function fillParameter(
  document: JsonObject,
  key: string,
  parameter: JsonObject,
  values: Values,
): void {
  if (parameter["required"] || key === "controls") {
    if (key in values) parameter["example"] = values[key]!;
    return;
  }
  const { example: _, ...schema } = resolved(document, parameter["schema"] as JsonObject);
  parameter["schema"] = schema;
  // Of an object without an example Swagger UI makes one.
  if (schema["type"] === "object") parameter["example"] = {};
  else delete parameter["example"];
}

function fillBody(document: JsonObject, body: JsonObject, values: Values): void {
  const content = body["content"] as Record<string, JsonObject> | undefined;
  const json = content?.["application/json"];
  if (!json) return;
  const schema = resolved(document, json["schema"] as JsonObject);
  const properties = (schema["properties"] ?? {}) as Record<string, JsonObject>;
  const example: JsonObject = {};
  for (const name of (schema["required"] ?? []) as string[]) {
    const own = resolved(document, properties[name] ?? {});
    const [first] = (own["enum"] ?? []) as Json[];
    example[name] = values[name] ?? own["example"] ?? own["default"] ?? first ?? null;
  }
  json["example"] = example;
}

function resolved(document: JsonObject, schema: JsonObject): JsonObject {
  const { $ref } = schema;
  if (typeof $ref !== "string") return schema;
  let found: Json = document;
  for (const part of $ref.replace("#/", "").split("/")) found = (found as JsonObject)[part]!;
  return resolved(document, found as JsonObject);
}
