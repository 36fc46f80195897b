/** Samples ask what the operation's examples ask, of this server, in three languages. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { parseYaml } from "@redocly/openapi-core";

import { foldDescription, type JsonObject, withExamples } from "../src/document.ts";
import { addSamples, curl, exampleRequest, javascript, python } from "../src/samples.ts";

const CONTRACT = parseYaml(
  readFileSync(new URL("../../../api/openapi.yaml", import.meta.url), "utf8"),
) as JsonObject;
const MODEL = { name: "dive", controls: [{ name: "height", default: 3 }] };
const ORIGIN = "https://motions.example:8443";
const document = withExamples(CONTRACT, MODEL);
const asked = (path: string, method: "get" | "post") =>
  exampleRequest(document, path, method, ORIGIN);

test("a query names this server, the loaded model and its controls", () => {
  const request = asked("/v1/models/{model}/clip.{format}", "get");
  assert.equal(request.url, `${ORIGIN}/v1/models/dive/clip.usda`);
  assert.deepEqual(request.query, [["height", "3"]]);
  assert.equal(request.file, "clip.usda");
  const address = `${ORIGIN}/v1/models/dive/clip.usda?height=3`;
  for (const code of [curl(request), javascript(request)]) assert.ok(code.includes(address), code);
  assert.ok(python(request).includes('params=[("height", "3")]'));
  assert.ok(python(request).includes('Path("clip.usda").write_bytes'));
});

test("a body is sent as JSON", () => {
  const request = asked("/v1/models/{model}/pose.{format}", "post");
  assert.deepEqual(request.body, { controls: { height: 3 }, times: [0] });
  assert.ok(curl(request).includes(`--data '{"controls":{"height":3},"times":[0]}'`));
  assert.ok(python(request).includes('json={"controls": {"height": 3}, "times": [0]}'));
  assert.ok(javascript(request).includes('method: "POST"'));
});

test("JSON is shown, and other formats are saved", () => {
  assert.equal(asked("/v1/models/{model}/pose.{format}", "post").file, null);
  assert.equal(asked("/v1/models/{model}/clips.{format}", "post").file, "clips.zip");
});

test("a quote in a value does not end the shell's word", () => {
  const odd = { ...asked("/v1/models/{model}", "get"), body: { name: "d'un geste" } };
  assert.ok(curl(odd).includes(`'{"name":"d'\\''un geste"}'`));
});

test("every operation has the three, and none an open parameter", () => {
  const own = structuredClone(document);
  addSamples(own, ORIGIN);
  let count = 0;
  for (const [path, item] of Object.entries(own["paths"] as Record<string, JsonObject>))
    for (const method of ["get", "post"]) {
      const operation = item[method] as JsonObject | undefined;
      if (!operation) continue;
      count++;
      const text = String(operation["description"]);
      for (const title of ["**curl**", "**Python**", "**JavaScript**"])
        assert.ok(text.includes(title), path);
      assert.ok(!/\{model\}|\{format\}/.test(text.split("<details>")[1]!), path);
    }
  assert.ok(count > 25);
});

test("conventions are folded below the first sentence", () => {
  const own = structuredClone(CONTRACT);
  foldDescription(own);
  const text = String((own["info"] as JsonObject)["description"]);
  assert.ok(text.indexOf("<details>") < 600);
  assert.ok(text.includes("**Caching.**"));
});
