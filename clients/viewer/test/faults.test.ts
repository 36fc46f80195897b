/** Faults in words, and what is done about them. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { TimedOut } from "@posefield/client";

import { understood } from "../src/faults.ts";
import { usable } from "../src/service.ts";

test("slowness is waited for; a fault of the page is called that", () => {
  assert.equal(understood(new TimedOut("slow"))!.remedy, "wait");
  assert.match(understood(new TypeError("x"))!.text, /^Something in this page went wrong/);
});

test("a key is what a header can hold", () => {
  for (const key of ["pf_aZ09-_", "eyJ.a~b+c/d=="]) assert.ok(usable(key), key);
  for (const key of ["", "ключ", "a b", "a\nb", "pf_…"]) assert.ok(!usable(key), key);
});
