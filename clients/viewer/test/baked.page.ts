/** A crowd with baked motions, as a graphics card draws it, beside the one that a processor draws. */

import assert from "node:assert/strict";
import { after, before, describe, it } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, SERVICE } from "./harness.ts";
import { until } from "./look.ts";

const STILL = "/#cmu_walk?~view=crowd&~playing=no&~time=0";
const [WIDTH, HEIGHT] = [640, 360];

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

/** In the page: WebGL names another renderer than the one it has. */
function hideRenderer(): void {
  const own = WebGL2RenderingContext.prototype.getParameter;
  WebGL2RenderingContext.prototype.getParameter = function (this: WebGL2RenderingContext, name) {
    return name === 0x9246 ? "a graphics card" : (own.call(this, name) as unknown);
  };
}

/** Brightness of the stage's pixels, small, so that smoothed edges do not count. */
async function lights(page: Page): Promise<number[]> {
  const png = (await page.locator("#stage canvas").screenshot()).toString("base64");
  return page.evaluate(
    async ({ png, width, height }) => {
      const image = Object.assign(new Image(), { src: `data:image/png;base64,${png}` });
      await image.decode();
      const pen = Object.assign(document.createElement("canvas"), { width, height }).getContext(
        "2d",
      )!;
      pen.drawImage(image, 0, 0, width, height);
      const { data } = pen.getImageData(0, 0, width, height);
      return Array.from({ length: width * height }, (_, at) => data[4 * at + 1]!);
    },
    { png, width: WIDTH / 2, height: HEIGHT / 2 },
  );
}

/** Share of pixels that differ by more than a tenth of the brightness. */
function unlike(one: readonly number[], other: readonly number[]): number {
  return one.filter((value, at) => Math.abs(value - other[at]!) > 25).length / one.length;
}
