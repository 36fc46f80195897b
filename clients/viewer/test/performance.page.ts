/** The view of performances: with the shipped models alone, by mouse, by keyboard and by text. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { broken } from "./axe.ts";
import { blank, browser, opened, SERVICE } from "./harness.ts";
import { picture, until } from "./look.ts";

const EMPTY = "/#cmu_walk?~playing=no&~view=performance";
const WALK = { kind: "walk", model: "cmu_walk", to: [0, 3], start: "standing" };
const TURN = { kind: "walk", model: "cmu_walk", seconds: 2 };
const at = (script: object) => `${EMPTY}&~script=${encodeURIComponent(JSON.stringify(script))}`;

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

interface Script {
  readonly segments: readonly Readonly<Record<string, unknown>>[];
}

/** A page, and the scripts that it asks for; refusals are written into its console by the browser. */
async function on(
  path: string,
  act: (page: Page, asked: Script[]) => Promise<void>,
  refusals: boolean | "maybe" = false,
): Promise<void> {
  const asked: Script[] = [];
  // The first script may be asked for before the page is loaded.
  const { page, faults } = await opened(chromium, path, undefined, (request) => {
    if (/\/v1\/performances/.test(request.url())) asked.push(request.postDataJSON());
  });
  try {
    await act(page, asked);
    const refused = faults.filter((fault) => /status of 4(00|04|22)/.test(fault));
    if (refusals !== "maybe") assert.equal(refused.length > 0, refusals, String(faults));
    assert.deepEqual(
      faults.filter((fault) => !refused.includes(fault)),
      [],
    );
  } finally {
    await page.close();
  }
}

const performedOn = (page: Page) => page.locator("#stage[data-performed]").waitFor();
const said = (page: Page, words: string | RegExp) =>
  page.locator(".performance-said", { hasText: words }).waitFor();
const bars = (page: Page) => page.locator(".bars button").allTextContents();

const script = (page: Page) => page.getByLabel("Script as JSON");

test("the shipped walk alone is a performance at once: timeline, contacts and duration", () =>
  on(EMPTY, async (page, asked) => {
    await performedOn(page);
    assert.deepEqual(await bars(page), ["1 cmu_walk"]);
    assert.equal(await page.locator("[data-note]").count(), 0);
    assert.equal(asked.at(-1)!.segments.length, 1);
    const duration = Number.parseFloat((await page.locator("[data-duration]").textContent())!);
    assert.ok(duration > 4 && duration < 15, String(duration));
    assert.equal(await page.locator(".lanes > div").count(), 2);
    assert.ok((await page.locator(".lanes i").count()) > 5);
    await until(async () => page.url().includes("~script="), "the address has the script");
  }));

test("models of other skeletons are refused at their line, and a mended script goes on", () =>
  on(
    at({ segments: [WALK, { kind: "act", model: "reaching" }] }),
    async (page) => {
      await said(page, /cannot be performed/);
      const fault = page.locator("[data-note=fault]");
      assert.match(
        (await fault.first().textContent())!,
        /^Line 3, \/segments\/0.*another skeleton/,
      );
      assert.ok(await page.getByRole("button", { name: /^Download/ }).isDisabled());
      await fault.first().getByRole("button").click();
      const selected = await script(page).evaluate((text: HTMLTextAreaElement) =>
        text.value.slice(text.selectionStart, text.selectionEnd),
      );
      assert.equal(selected, '"cmu_walk"');
      await script(page).fill(JSON.stringify({ segments: [{ kind: "act", model: "reaching" }] }));
      await performedOn(page);
      await said(page, /^1 segment/);
      assert.equal(await fault.count(), 0);
      assert.deepEqual(await bars(page), ["1 reaching"]);
    },
    true,
  ));

test("the text is checked as it is typed: by its form, and by the contract", () =>
  on(
    at({ segments: [WALK] }),
    async (page, asked) => {
      await performedOn(page);
      const text = script(page);
      const whole = await text.inputValue();
      assert.deepEqual(JSON.parse(whole), { segments: [WALK] });
      const fault = (words: string) => page.locator("[data-note=fault]", { hasText: words });
      await text.fill("{");
      await fault("not JSON").waitFor();
      assert.equal(await text.getAttribute("aria-invalid"), "true");
      await text.fill(whole.replace('"start"', '"begin"'));
      await fault("begin").waitFor();
      await text.fill(whole.replace('"start"', '"speed": 90, "start"'));
      await fault("Line 3, /segments/0/speed").waitFor();
      assert.equal(await page.locator(".bars [data-notes=fault]").count(), 1);
      await text.fill(whole.replace("[0, 3]", "[1, 4]"));
      await until(
        async () => asked.at(-1)!.segments[0]!["to"]?.toString() === "1,4",
        "it is asked",
      );
      await said(page, /^1 segment/);
      assert.equal(await text.getAttribute("aria-invalid"), "false");
    },
    true,
  ));

test("the plan shows the path, points, targets and obstacles", () => {
  const act = {
    kind: "act",
    model: "reaching",
    targets: [{ joint: "Head", at: "end", position: [0, 1.5, 1] }],
  };
  const obstacles = [{ position: [0.2, 2], radius: 0.4 }];
  return on(
    at({ segments: [WALK, act], obstacles }),
    async (page) => {
      await said(page, /cannot be performed/);
      for (const kind of ["start", "target", "obstacle"])
        await page.locator(`.plan .plan-${kind}`).waitFor();
      await script(page).fill(JSON.stringify({ segments: [WALK, TURN] }));
      await until(async () => (await page.locator(".plan .plan-path").count()) === 2, "two paths");
      assert.equal(await page.locator(".plan .plan-point").count(), 1);
    },
    true,
  );
});

test("the link shows the same performance; another time is another picture", () =>
  on(at({ segments: [WALK, TURN] }), async (page) => {
    await performedOn(page);
    const first = await picture(page);
    await page.keyboard.press("End");
    const last = await picture(page);
    assert.ok(!first.equals(last));
    await page.keyboard.press("Home");
    await until(async () => page.url().includes("~script="), "the address has the script");
    await on(new URL(page.url()).hash.replace("#", "/#"), async (other) => {
      await performedOn(other);
      assert.deepEqual(await bars(other), ["1 cmu_walk", "2 cmu_walk"]);
      assert.ok(first.equals(await picture(other)), "the same picture");
    });
    // A button that has the focus would take the key for itself.
    await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await page.keyboard.press(" ");
    const time = page.getByLabel("Time in the performance");
    await until(async () => Number(await time.inputValue()) > 0.2, "it plays");
  }));

test("files are those that the service gives, and scripts are saved and opened", () =>
  on(at({ segments: [TURN] }), async (page, asked) => {
    await performedOn(page);
    for (const format of ["usdc", "glb", "npz", "msgpack"]) {
      await page.locator("[data-part=performance]").getByLabel("Format").selectOption(format);
      const coming = page.waitForEvent("download");
      await page.getByRole("button", { name: `Download performance.${format}` }).click();
      const saved = readFileSync((await (await coming).path())!);
      const answer = await fetch(`${SERVICE}/v1/performances.${format}`, {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify({ segments: [TURN] }),
      });
      assert.ok(saved.equals(Buffer.from(await answer.arrayBuffer())), format);
    }
    const coming = page.waitForEvent("download");
    await page.getByRole("button", { name: "Save script" }).click();
    const saved = readFileSync((await (await coming).path())!, "utf8");
    assert.deepEqual(JSON.parse(saved), { segments: [TURN] });
    await page.locator('input[type=file][accept^=".json"]').setInputFiles({
      name: "other.json",
      mimeType: "application/json",
      buffer: Buffer.from(saved.replace('"seconds": 2', '"seconds": 3')),
    });
    await until(async () => asked.at(-1)!.segments[0]!["seconds"] === 3, "the file is opened");
  }));

for (const [colorScheme, width, height] of [
  ["light", 1280, 720],
  ["dark", 390, 844],
] as const)
  test(`axe finds nothing serious, ${colorScheme}, ${width} px, and nothing is too wide`, async () => {
    const page = await blank(chromium, {
      viewport: { width, height },
      colorScheme,
      bypassCSP: true,
    });
    await page.goto(SERVICE + at({ segments: [WALK, TURN, { kind: "hold", seconds: 1 }] }));
    await performedOn(page);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(wide <= 0, `${wide} px too wide`);
    assert.deepEqual(await broken(page), []);
    await page.evaluate(() => {
      document.querySelector(".performance-file select")!.removeAttribute("id");
    });
    assert.match(
      (await broken(page)).join(),
      /select-name/,
      "it would notice a field without a name",
    );
    await page.close();
  });
