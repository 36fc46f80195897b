/** Bodies that are no people: a quadruped that walks and a hand that grips. */

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

for (const [model, control, value] of [
  ["quadruped", "speed", "0.6"],
  ["hand", "width", "0.065"],
] as const)
  test(`the page draws the ${model}, and it follows its controls`, async () => {
    const { page, faults } = await opened(chromium, `/#${model}?~playing=no&~time=0.5`);
    try {
      await settled(page);
      const first = await picture(page);
      await slider(page, control).fill(value);
      await until(async () => page.url().includes(`${control}=`), "the address follows");
      assert.ok(!first.equals(await picture(page)), "the picture changes");
      assert.deepEqual(faults, []);
    } finally {
      await page.close();
    }
  });
