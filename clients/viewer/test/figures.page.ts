/** A body that is no person: a quadruped that walks. */

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import type { Browser } from "playwright-core";

import { browser, opened } from "./harness.ts";
import { picture, settled, slider, until } from "./look.ts";

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

test("the page draws a quadruped, and it follows its controls", async () => {
  const { page, faults } = await opened(chromium, "/#quadruped?~playing=no&~time=0.5");
  try {
    await settled(page);
    const first = await picture(page);
    await slider(page, "speed").fill("0.6");
    await until(async () => page.url().includes("speed="), "the address follows");
    assert.ok(!first.equals(await picture(page)), "the picture changes");
    assert.deepEqual(faults, []);
  } finally {
    await page.close();
  }
});
