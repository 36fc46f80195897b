/** References are replaced by what they name, also where that names itself. */

import assert from "node:assert/strict";
import { test } from "node:test";

import type { JsonObject } from "../src/document.ts";
import strategy, { found, resolved } from "../src/resolver.ts";

const DOCUMENT: JsonObject = {
  openapi: "3.1.0",
  paths: { "/a": { get: { schema: { $ref: "#/parts/pair" } } } },
  parts: {
    pair: { left: { $ref: "#/parts/leaf" }, right: { $ref: "#/parts/leaf", title: "own" } },
    leaf: { type: "number", title: "leaf" },
    tree: { items: { $ref: "#/parts/tree" } },
    "odd/name": { type: "string" },
  },
};

test("a reference is replaced, and keys beside it win", () => {
  assert.deepEqual(resolved(DOCUMENT, { $ref: "#/parts/pair" }, []), {
    left: { type: "number", title: "leaf" },
    right: { type: "number", title: "own" },
  });
});

test("a schema in itself keeps the inner reference", () => {
  assert.deepEqual(resolved(DOCUMENT, { $ref: "#/parts/tree" }, []), {
    items: { $ref: "#/parts/tree" },
  });
});

test("a slash in a name is escaped", () => {
  assert.deepEqual(found(DOCUMENT, "#/parts/odd~1name"), { type: "string" });
});

test("only what is below the path is resolved", async () => {
  assert.ok(strategy.match(DOCUMENT));
  assert.ok(!strategy.match({ openapi: "3.0.3" }));
  const { spec } = await strategy.resolve({
    spec: DOCUMENT,
    pathDiscriminator: ["paths", "/a", "get"],
  });
  const operation = ((spec["paths"] as JsonObject)["/a"] as JsonObject)["get"] as JsonObject;
  assert.deepEqual((operation["schema"] as JsonObject)["left"], { type: "number", title: "leaf" });
  assert.deepEqual(spec["parts"], DOCUMENT["parts"]);
});
