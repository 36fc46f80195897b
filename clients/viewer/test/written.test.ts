/** Numbers that people type. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { centimetres, figure, precise, read, short, whole } from "../src/written.ts";

test("numbers are read", () => {
  for (const [text, value] of [
    ["1.5", 1.5],
    [" -2 ", -2],
    ["−3", -3],
    [".5", 0.5],
    ["1e-3", 0.001],
  ] as const)
    assert.equal(read(text), value);
});

test("what is no number is refused in words", () => {
  assert.match(String(read("1,5")), /write 1\.5/);
  for (const text of ["", "abc", "1.5.2", "0x10", "1 2", "Infinity", "--1"])
    assert.equal(typeof read(text), "string", text);
});

test("digits are those that the range is worth", () => {
  assert.equal(short(1.23456, 1), "1.23");
  assert.equal(short(-0.0001, 150), "0");
  assert.equal(short(15.83333, 150), "16");
  assert.equal(centimetres(0.0136), "1.4 cm");
  assert.equal(centimetres(0.136), "14 cm");
});

test("what is compared has three digits, and thousands stand apart", () => {
  assert.equal(precise(0.01227), "1.23 cm");
  assert.equal(figure(-1234.5), "−1230");
  assert.equal(whole(37293), "37,293");
});
