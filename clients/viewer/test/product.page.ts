/** The page as users meet it: on a phone and a desk, at the first visit, with presets. */

import assert from "node:assert/strict";
import { after, before, describe, it } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, opened } from "./harness.ts";
import { settled, typed, until } from "./look.ts";

const SIZES = [
  { width: 390, height: 844 },
  { width: 768, height: 1024 },
  { width: 1440, height: 900 },
];

let from: Browser;
before(async () => {
  from = await browser();
});
after(() => from.close());

/** Elements of a kind that lie beyond the window's sides. */
function beyond(page: Page, selector: string): Promise<string[]> {
  return page.evaluate((selector) => {
    const all = [...document.querySelectorAll<HTMLElement>(selector)];
    const shown = all.filter((each) => each.checkVisibility());
    const out = shown.filter((each) => {
      const { left, right } = each.getBoundingClientRect();
      return left < 0 || right > innerWidth;
    });
    return out.map((each) => each.outerHTML.slice(0, 80));
  }, selector);
}

for (const size of SIZES)
  describe(`${size.width} px wide`, () => {
    let page: Page;
    before(async () => {
      ({ page } = await opened(from, "/#cmu_walk", size));
      await settled(page);
    });
    after(() => page.close());

    it("nothing lies beyond the sides", async () => {
      const width = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.equal(width, size.width);
      assert.deepEqual(await beyond(page, "button, select, input, h1, h2, p"), []);
    });

    it("download, link and map are reached without scrolling", async () => {
      for (const name of ["Download", "Map", "Copy link"]) {
        const found = page.getByRole("button", { name, exact: true });
        const { x, y, width, height } = (await found.boundingBox())!;
        assert.ok(x >= 0 && x + width <= size.width && y >= 0 && y + height <= size.height, name);
      }
      for (const [name, inside] of [
        ["Map", ".map-canvas"],
        ["Download", ".files-get"],
      ] as const) {
        await page.getByRole("button", { name, exact: true }).click();
        const met = () =>
          page.locator(inside).evaluate((each) => {
            const { top } = each.getBoundingClientRect();
            return top >= 0 && top < innerHeight;
          });
        await until(met, `${inside} is in view`);
      }
    });

    it("captions are not cut", async () => {
      const cut = await page.evaluate(() =>
        [...document.querySelectorAll<HTMLElement>(".about, .source, .map-words")]
          .filter((each) => each.checkVisibility() && each.scrollWidth > each.clientWidth + 1)
          .map((each) => each.textContent),
      );
      assert.deepEqual(cut, []);
    });
  });

it("the first visit has a headline and a hint, which stay away once closed", async () => {
  const context = await from.newContext();
  const page = await context.newPage();
  const address = new URL("/#cmu_walk", process.env["POSEFIELD_URL"] ?? "http://127.0.0.1:8000");
  await page.goto(address.href);
  const hint = page.locator(".welcome");
  await hint.getByRole("heading").waitFor();
  assert.match(await hint.innerText(), /slider/);
  await page.getByRole("button", { name: "Close this hint" }).click();
  await hint.waitFor({ state: "hidden" });
  await page.reload();
  await settled(page);
  assert.equal(await hint.count(), 0);
  await context.close();
});

describe("presets", () => {
  it("set the controls, and show where one is", async () => {
    const { page, faults } = await opened(from, "/#cmu_walk");
    await settled(page);
    const hurry = page.getByRole("button", { name: "Hurry" });
    assert.equal(await hurry.getAttribute("aria-pressed"), "false");
    await hurry.click();
    assert.equal(Number(await typed(page, "speed").inputValue()), 1.7);
    assert.equal(await hurry.getAttribute("aria-pressed"), "true");
    await typed(page, "speed").fill("1.5");
    await typed(page, "speed").press("Enter");
    assert.equal(await hurry.getAttribute("aria-pressed"), "false");
    assert.deepEqual(faults, []);
    await page.close();
  });

  it("are not shown for a model without", async () => {
    const { page } = await opened(from, "/livez");
    await page.route(/\/v1\/models\/cmu_walk$/, async (route) => {
      const answer = await route.fetch();
      const { presets: _, ...card } = (await answer.json()) as Record<string, unknown>;
      await route.fulfill({ response: answer, json: card });
    });
    await page.goto(new URL("/#cmu_walk", page.url()).href);
    await settled(page);
    assert.equal(await page.locator(".presets").count(), 0);
    await page.close();
  });
});

it("the link that is copied is the address", async () => {
  const { page } = await opened(from, "/#cmu_walk");
  await settled(page);
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.getByRole("button", { name: "Copied" }).waitFor();
  assert.equal(await page.evaluate(() => navigator.clipboard.readText()), page.url());
  await page.close();
});

describe("what a download holds exactly", () => {
  const link = async (page: Page) => {
    await page.locator(".files").getByRole("button", { name: "Link", exact: true }).click();
    return new URL(await page.locator(".files pre").innerText()).searchParams;
  };

  it("is the target of the handle", async () => {
    const { page } = await opened(from, "/#reaching?~target=-0.25,1.25,0.5");
    await settled(page);
    assert.equal((await link(page)).get("target"), "RightHand@event:-0.25,1.25,0.5");
    await page.getByText("The file meets the target").waitFor();
    await page.getByRole("button", { name: "Reset all controls (R)" }).click();
    await typed(page, "turn").fill("12");
    await typed(page, "turn").press("Enter");
    await until(async () => !(await link(page)).has("target"), "a moved control ends the target");
    await page.close();
  });

  it("is the feet and the measured controls", async () => {
    const { page } = await opened(from, "/#cmu_walk?speed=1.2&turn=0&stride_length=1.3");
    await settled(page);
    assert.ok(!(await link(page)).has("feet") && !(await link(page)).has("exact"));
    await page.getByRole("button", { name: "Feet stand" }).click();
    await page.getByLabel(/Match exactly: Speed/).uncheck();
    const found = await link(page);
    assert.equal(found.get("feet"), "as_predicted");
    assert.equal(found.get("exact"), "none");
    await page.close();
  });
});

it("the crowd says how far its motions are", async () => {
  const { page } = await opened(from, "/#cmu_walk");
  await settled(page);
  await page.route(/crowd/, async (route) => {
    await new Promise((done) => setTimeout(done, 300));
    await route.continue();
  });
  await page.getByRole("button", { name: "Crowd" }).click();
  const bar = page.getByRole("progressbar", { name: "Motions computed" });
  await bar.waitFor();
  const share = () => bar.evaluate((each) => (each as HTMLProgressElement).value);
  await until(async () => (await share()) > 0.1 && (await share()) < 1, "some are there");
  await page.locator(".crowd[data-frame]").waitFor({ timeout: 60_000 });
  await bar.waitFor({ state: "hidden" });
  await page.close();
});
