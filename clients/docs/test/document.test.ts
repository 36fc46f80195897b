/** The examples of the contract are those that a loaded model answers. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { parseYaml } from "@redocly/openapi-core";

import { type Json, type JsonObject, withExamples } from "../src/document.ts";

const CONTRACT = parseYaml(
  readFileSync(new URL("../../../api/openapi.yaml", import.meta.url), "utf8"),
) as JsonObject;
const MODEL = {
  name: "dive",
  controls: [
    { name: "height", default: 3 },
    { name: "twist", default: 0.5 },
  ],
};
const CONTROLS = { height: 3, twist: 0.5 };

function at(document: JsonObject, ...path: string[]): Json {
  return path.reduce((found: Json, part) => (found as JsonObject)[part]!, document);
}

function parameters(document: JsonObject): Record<string, JsonObject> {
  return at(document, "components", "parameters") as Record<string, JsonObject>;
}

/** Example bodies by path, for operations whose body stands beside them or among the components. */
function bodies(document: JsonObject): Map<string, JsonObject> {
  const found = new Map<string, JsonObject>();
  for (const [path, item] of Object.entries(at(document, "paths") as Record<string, JsonObject>)) {
    const post = item["post"] as JsonObject | undefined;
    if (!post) continue;
    let body = post["requestBody"] as JsonObject;
    const name = (body["$ref"] as string | undefined)?.split("/").at(-1);
    if (name) body = at(document, "components", "requestBodies", name) as JsonObject;
    found.set(path, at(body, "content", "application/json", "example") as JsonObject);
  }
  return found;
}

test("parameters that are needed name the model and its controls", () => {
  const found = parameters(withExamples(CONTRACT, MODEL));
  assert.equal(found["model"]!["example"], "dive");
  assert.deepEqual(found["controls"]!["example"], CONTROLS);
  assert.deepEqual(found["time"]!["example"], [0]);
  assert.equal(found["across"]!["example"], "height");
  assert.equal(found["along"]!["example"], "twist");
});

test("other parameters have no example, and so are not sent", () => {
  const found = Object.entries(parameters(withExamples(CONTRACT, MODEL)));
  for (const [name, parameter] of found) {
    if (parameter["required"] || name === "controls") continue;
    assert.deepEqual(parameter["example"] ?? {}, {}, name);
    assert.ok(!("example" in (parameter["schema"] as JsonObject)), name);
  }
  const before = Object.values(parameters(CONTRACT));
  assert.ok(before.some((one) => "example" in one && !one["required"]));
});

test("bodies hold what is needed and nothing else", () => {
  const found = bodies(withExamples(CONTRACT, MODEL));
  assert.ok(found.size > 10);
  assert.deepEqual(found.get("/v1/models/{model}/pose"), { controls: CONTROLS, times: [0] });
  assert.deepEqual(found.get("/v1/models/{model}/clip.{format}"), { controls: CONTROLS });
  assert.deepEqual(found.get("/v1/models/{model}/crowd"), { controls: CONTROLS, time: [0] });
  assert.deepEqual(found.get("/v1/models/{model}/sigma"), { across: "height", along: "twist" });
  const clips = { format: "usdc", clips: [{ name: "first", controls: CONTROLS }] };
  assert.deepEqual({ ...found.get("/v1/models/{model}/clips"), format: "usdc" }, clips);
  const act = { segments: [{ kind: "act", model: MODEL.name, controls: CONTROLS }] };
  assert.deepEqual(found.get("/v1/performances"), act);
  const scripts = [{ name: "first", ...act }];
  assert.deepEqual(
    { ...found.get("/v1/performances/batch"), format: "usdc" },
    { format: "usdc", scripts },
  );
  const gait = bodies(withExamples(CONTRACT, { ...MODEL, cyclic: true }));
  const walk = { segments: [{ kind: "walk", model: MODEL.name, seconds: 2 }] };
  assert.deepEqual(gait.get("/v1/performances.{format}"), walk);
  for (const [path, body] of found) assert.ok(!Object.values(body).includes(null), path);
});

test("without a model the contract's own examples stay where they are needed", () => {
  const found = parameters(withExamples(CONTRACT, undefined));
  assert.equal(found["model"]!["example"], parameters(CONTRACT)["model"]!["example"]);
});

test("a model with one control has no grid of two", () => {
  const one = { name: "lift", controls: [{ name: "height", default: 1 }] };
  const found = parameters(withExamples(CONTRACT, one));
  assert.equal(found["across"]!["example"], parameters(CONTRACT)["across"]!["example"]);
});

test("the contract that is given stays as it is", () => {
  const before = JSON.stringify(CONTRACT);
  withExamples(CONTRACT, MODEL);
  assert.equal(JSON.stringify(CONTRACT), before);
});
