/** Code that asks each operation's example question, in curl, Python and JavaScript. */

import type { Json, JsonObject } from "./document.ts";
import { resolved } from "./resolver.ts";

/** A request as a client sends it. */
export interface Request {
  readonly method: "GET" | "POST";
  readonly url: string;
  readonly query: readonly (readonly [string, string])[];
  readonly body: Json | undefined;
  /** File name for a binary or long response. */
  readonly file: string | null;
}

const METHODS = ["get", "post"] as const;

/** Append a folded section with code to the description of every operation. */
export function addSamples(document: JsonObject, origin: string): void {
  for (const [path, item] of Object.entries(document["paths"] as Record<string, JsonObject>))
    for (const method of METHODS) {
      const operation = item[method] as JsonObject | undefined;
      if (!operation) continue;
      const text = section(exampleRequest(document, path, method, origin));
      operation["description"] = `${operation["description"] ?? ""}\n\n${text}`;
    }
}

/** Return the request of an operation's examples. */
export function exampleRequest(
  document: JsonObject,
  path: string,
  method: (typeof METHODS)[number],
  origin: string,
): Request {
  const operation = (document["paths"] as Record<string, JsonObject>)[path]![method] as JsonObject;
  let filled = path;
  const query: [string, string][] = [];
  for (const raw of (operation["parameters"] ?? []) as JsonObject[]) {
    const parameter = resolved(document, raw, []) as JsonObject;
    const { example } = parameter;
    if (example === undefined) continue;
    if (parameter["in"] === "path") filled = filled.replace(`{${parameter["name"]}}`, `${example}`);
    if (parameter["in"] === "query") query.push(...pairs(String(parameter["name"]), example));
  }
  const [, name] = filled.match(/\/(\w+\.\w+)$/) ?? [];
  const named = filled.startsWith("/v1/") && name && !name.endsWith(".json") ? name : null;
  const body = exampleBody(document, operation);
  const verb = method === "get" ? "GET" : "POST";
  return { method: verb, url: origin + filled, query, body, file: named };
}

/** Query parameters of an example, as `style: form` with `explode` writes them. */
function pairs(name: string, example: Json): [string, string][] {
  if (Array.isArray(example)) return example.map((each) => [name, String(each)]);
  if (example !== null && typeof example === "object")
    return Object.entries(example).map(([key, value]) => [key, String(value)]);
  return [[name, String(example)]];
}

function exampleBody(document: JsonObject, operation: JsonObject): Json | undefined {
  if (!operation["requestBody"]) return undefined;
  const body = resolved(document, operation["requestBody"], []) as JsonObject;
  const content = body["content"] as Record<string, JsonObject>;
  return content["application/json"]?.["example"];
}

function section(request: Request): string {
  const blocks = [
    ["curl", "sh", curl(request)],
    ["Python", "python", python(request)],
    ["JavaScript", "js", javascript(request)],
  ].map(([title, language, code]) => `**${title}**\n\n\`\`\`${language}\n${code}\n\`\`\``);
  return `<details><summary>Code: curl, Python, JavaScript</summary>\n\n${blocks.join("\n\n")}\n\n</details>`;
}

function address({ url, query }: Request): string {
  const text = query.map(([name, value]) => `${name}=${encodeURIComponent(value)}`).join("&");
  return text ? `${url}?${text}` : url;
}

/** For a POSIX shell. */
export function curl(request: Request): string {
  const { body, file } = request;
  const words = ["curl --fail"];
  if (file) words.push(`--output ${file}`);
  if (body !== undefined)
    words.push(
      "--header 'Content-Type: application/json'",
      `--data ${quoted(JSON.stringify(body))}`,
    );
  words.push(quoted(address(request)));
  return words.join(" \\\n  ");
}

/** For Python 3 with httpx. */
export function python(request: Request): string {
  const { method, url, query, body, file } = request;
  const given = [`    ${JSON.stringify(url)},`];
  if (query.length)
    given.push(
      `    params=[${query.map(([a, b]) => `(${literal(a)}, ${literal(b)})`).join(", ")}],`,
    );
  if (body !== undefined) given.push(`    json=${literal(body)},`);
  const ask = [
    `response = httpx.${method.toLowerCase()}(`,
    ...given,
    ")",
    "response.raise_for_status()",
  ];
  const use = file
    ? [`Path(${literal(file)}).write_bytes(response.content)`]
    : ["print(response.text)"];
  const heads = file ? ["from pathlib import Path", "", "import httpx"] : ["import httpx"];
  return [...heads, "", ...ask, ...use].join("\n");
}

/** For browsers, Node and Deno. */
export function javascript(request: Request): string {
  const { body, file } = request;
  const options =
    body === undefined
      ? ""
      : `, {
  method: "POST",
  headers: { "Content-Type": "application/json" },
  body: JSON.stringify(${JSON.stringify(body)}),
}`;
  return [
    `const response = await fetch(${JSON.stringify(address(request))}${options});`,
    "if (!response.ok) throw new Error(await response.text());",
    file ? "const content = await response.arrayBuffer();" : "console.log(await response.text());",
  ].join("\n");
}

function quoted(text: string): string {
  return `'${text.replaceAll("'", "'\\''")}'`;
}

/** A JSON value as Python writes it. */
function literal(value: Json): string {
  if (value === null) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (Array.isArray(value)) return `[${value.map(literal).join(", ")}]`;
  if (typeof value === "object") {
    const entries = Object.entries(value).map(([key, each]) => `${literal(key)}: ${literal(each)}`);
    return `{${entries.join(", ")}}`;
  }
  return JSON.stringify(value);
}
