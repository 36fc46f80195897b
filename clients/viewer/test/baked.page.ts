/** A crowd with baked motions, as a graphics card draws it, beside the one that a processor draws. */

import assert from "node:assert/strict";
import { after, before, describe, it } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, SERVICE } from "./harness.ts";
import { hideRenderer, lights, unlike, until } from "./look.ts";

const STILL = "/#cmu_walk?~view=crowd&~playing=no&~time=0";

describe("the crowd of a graphics card", () => {
  let from: Browser;

  before(async () => {
    from = await browser();
  });
  after(() => from.close());

  /** The crowd's page; `card` hides that a processor draws, so that motions are baked. */
  async function crowd(hash: string, card: boolean): Promise<{ page: Page; faults: string[] }> {
    const own = await from.newContext({ viewport: { width: 1280, height: 720 } });
    if (card) await own.addInitScript(hideRenderer);
    const page = await own.newPage();
    const faults: string[] = [];
    page.on("pageerror", (fault) => faults.push(String(fault)));
    page.on("console", (line) => {
      if (line.type() === "error") faults.push(line.text());
    });
    await page.goto(SERVICE + hash);
    await page.locator(".crowd li b", { hasText: /\d/ }).first().waitFor({ timeout: 60_000 });
    await page.locator("#stage canvas[data-rest]").waitFor();
    return { page, faults };
  }

  it("stands as that of a processor does", async () => {
    const [baked, plain] = [await crowd(STILL, true), await crowd(STILL, false)];
    const [one, other] = [await lights(baked.page), await lights(plain.page)];
    const apart = unlike(one, other);
    assert.ok(apart < 0.02, `${apart} of the picture differs`);
    // Negative control: the same crowd some steps later.
    await plain.page.keyboard.press(" ");
    await plain.page.waitForTimeout(700);
    await plain.page.keyboard.press(" ");
    await plain.page.locator("#stage canvas[data-rest]").waitFor();
    const later = unlike(one, await lights(plain.page));
    assert.ok(later > 3 * apart, `${later} after ${apart}`);
    assert.deepEqual([baked.faults, plain.faults], [[], []]);
    await baked.page.context().close();
    await plain.page.context().close();
  });

  it("is as many as ten thousand", async () => {
    const { page, faults } = await crowd("/#cmu_walk?~view=crowd&~playing=no&~crowd=10000", false);
    const counts = await page.locator(".crowd li b").allInnerTexts();
    assert.equal(
      counts.reduce((sum, each) => sum + Number(each), 0),
      10_000,
    );
    await until(
      async () => /10,000 characters/.test(await page.locator(".crowd").innerText()),
      "the panel says so",
    );
    assert.deepEqual(faults, []);
    await page.context().close();
  });
});
