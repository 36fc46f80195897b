import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { atLevel, BadModel, metadata } from "../src/offline/protobuf.ts";

const text = (word: string): number[] => [...new TextEncoder().encode(word)];
const field = (number: number, content: number[]): number[] => [
  (number << 3) | 2,
  content.length,
  ...content,
];
const tensor = (name: string): number[] => field(5, field(8, text(name)));
const input = (name: string): number[] => field(11, field(1, text(name)));
const entry = (key: string, value: string): number[] =>
  field(14, [...field(1, text(key)), ...field(2, text(value))]);

const GRAPH = [
  ...tensor("core"),
  ...tensor("level"),
  ...tensor("performer"),
  ...input("time"),
  ...input("level"),
  ...input("performer"),
];
// A version as a whole number comes first, as in every model.
const MODEL = Uint8Array.from([8, 9, ...field(7, GRAPH), ...entry("posefield.name", '"walk"')]);

const count = (model: Uint8Array, word: string): number =>
  new TextDecoder("latin1").decode(model).split(word).length - 1;

describe("a model file in a browser", () => {
  it("says what it says of itself", () => {
    assert.deepEqual([...metadata(MODEL)], [["posefield.name", '"walk"']]);
  });

  it("has its level as a constant and its performer as an input", () => {
    const frozen = atLevel(MODEL, 2);
    assert.deepEqual([count(MODEL, "level"), count(frozen, "level")], [2, 1]);
    assert.deepEqual([count(MODEL, "performer"), count(frozen, "performer")], [2, 1]);
    assert.deepEqual([count(frozen, "core"), count(frozen, "time")], [1, 1]);
    assert.deepEqual([...metadata(frozen)], [...metadata(MODEL)]);
    assert.notDeepEqual(frozen, atLevel(MODEL, 1));
  });

  it("is refused where it breaks off", () => {
    assert.throws(() => metadata(MODEL.subarray(0, MODEL.length - 3)), BadModel);
    assert.throws(() => metadata(Uint8Array.from([0x80])), BadModel);
    assert.throws(() => metadata(Uint8Array.from([0x0b, 0])), BadModel);
  });
});
