/** The view of performances: with the shipped models alone, by mouse, by keyboard and by text. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, opened, SERVICE } from "./harness.ts";
import { picture, until } from "./look.ts";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
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

/** Where the chosen walk's points are drawn, px of the window. */
async function points(page: Page): Promise<[number, number][]> {
  let before: string | null = "";
  const text = () => page.locator("[data-part=floor]").getAttribute("data-points");
  await until(async () => {
    await page.waitForTimeout(250);
    await page.locator("#stage canvas[data-rest]").waitFor();
    const [last, now] = [before, await text()];
    before = now;
    return now === last;
  }, "the stage rests");
  const box = (await page.locator("#stage canvas").boundingBox())!;
  return before.split(" ").map((place) => {
    const [x, y] = place.split(",").map(Number);
    return [box.x + x!, box.y + y!];
  });
}

test("the shipped walk alone is a performance at once: timeline, contacts and duration", () =>
  on(EMPTY, async (page, asked) => {
    await performedOn(page);
    assert.deepEqual(await bars(page), ["1 cmu_walk"]);
    assert.equal(asked.at(-1)!.segments.length, 1);
    const duration = Number.parseFloat((await page.locator("[data-duration]").textContent())!);
    assert.ok(duration > 4 && duration < 15, String(duration));
    assert.equal(await page.locator(".lanes > div").count(), 2);
    assert.ok((await page.locator(".lanes i").count()) > 5);
    await until(async () => page.url().includes("~script="), "the address has the script");
  }));

test("points are clicked onto the floor and dragged there, and the walk follows", () =>
  on(
    at({ segments: [WALK] }),
    async (page, asked) => {
      await performedOn(page);
      await page.getByRole("button", { name: /^Draw path/ }).click();
      // The view may still move to above the floor when it is clicked for the first time.
      await until(async () => {
        const [[x, y]] = (await points(page)) as [[number, number]];
        await page.mouse.click(x - 12, y - 80);
        await page.waitForTimeout(2000);
        return asked.at(-1)?.segments[0]?.["along"] !== undefined;
      }, "a point is added");
      const along = asked.at(-1)!.segments[0]!["along"] as number[][];
      assert.deepEqual(along[0], [0, 3]);
      assert.ok(along[1]![0]! > 0.05 && along[1]![1]! > 3.3, String(along));
      await until(async () => (await points(page)).length === 2, "both points are drawn");
      const [, [px, py]] = (await points(page)) as [unknown, [number, number]];
      await page.mouse.move(px, py);
      await page.mouse.down();
      await page.mouse.move(px + 20, py - 10, { steps: 4 });
      await page.mouse.up();
      const moved = () => (asked.at(-1)!.segments[0]!["along"] as number[][])[1]!;
      await until(async () => moved()[0]! < along[1]![0]! - 0.05, "the point is moved");
      assert.ok(moved()[1]! > along[1]![1]!);
      await said(page, /^1 segment/);
      assert.equal(asked.at(-1)!.segments.length, 1);
      // Without drawing, a click on the floor adds nothing.
      await page.keyboard.press("Escape");
      await page.waitForTimeout(600);
      const count = asked.length;
      await page.mouse.click(px - 90, py + 40);
      await page.waitForTimeout(600);
      assert.equal(asked.length, count);
    },
    "maybe",
  ));

test("segments are added, moved and deleted by the keyboard, which stays where it was", () =>
  on(at({ segments: [WALK] }), async (page, asked) => {
    await performedOn(page);
    for (const kind of ["walk", "hold"]) {
      await page.getByRole("button", { name: `Add a ${kind} after` }).focus();
      await page.keyboard.press("Enter");
      await page
        .locator(".segments > li[data-chosen]", { hasText: new RegExp(kind, "i") })
        .waitFor();
    }
    await said(page, /^3 segments/);
    await until(async () => (await bars(page))[2] === "3 hold", "the timeline has it");
    await page.getByLabel("Duration, s").fill("2.5");
    await page.keyboard.press("Enter");
    await until(async () => asked.at(-1)!.segments[2]?.["seconds"] === 2.5, "the hold is longer");
    await page.getByRole("button", { name: "Move segment 3 up" }).focus();
    await page.keyboard.press("Enter");
    await until(async () => asked.at(-1)!.segments[1]?.["kind"] === "hold", "the hold has moved");
    const focused = () => page.evaluate(() => document.activeElement?.getAttribute("aria-label"));
    assert.equal(await focused(), "Move segment 2 up");
    await page.getByRole("button", { name: "Delete segment 2" }).press("Enter");
    await until(async () => asked.at(-1)!.segments.length === 2, "the hold is gone");
    await until(async () => (await bars(page)).length === 2, "the timeline follows");
  }));

test("models of other skeletons are refused at their segment, and a mended script goes on", () =>
  on(
    at({ segments: [WALK, { kind: "act", model: "reaching" }] }),
    async (page) => {
      await said(page, /cannot be performed/);
      const fault = page.locator(".segments > li [data-note=fault]");
      assert.match((await fault.first().textContent())!, /another skeleton/);
      const marked = page.locator('.segments > li[data-notes="fault"]');
      assert.equal(await marked.count(), 1);
      assert.ok(await page.getByRole("button", { name: /^Download/ }).isDisabled());
      await page.getByRole("button", { name: "Delete segment 1" }).click();
      await performedOn(page);
      await said(page, /^1 segment/);
      assert.equal(await fault.count(), 0);
      assert.deepEqual(await bars(page), ["1 reaching"]);
    },
    true,
  ));

test("a wrong field is marked where the service points at, until it is mended", () =>
  on(
    at({ segments: [WALK, TURN] }),
    async (page) => {
      await performedOn(page);
      await page.locator(".segments .open").nth(1).click();
      const speed = page.getByLabel("Speed, m/s");
      await speed.fill("9");
      await speed.press("Tab");
      await said(page, /cannot be performed/);
      await page.locator('.segments > li[data-notes="fault"]').nth(0).waitFor();
      assert.equal(await speed.getAttribute("aria-invalid"), "true");
      assert.equal(await page.getByLabel("Duration, s").getAttribute("aria-invalid"), null);
      assert.equal(await page.locator(".bars [data-notes=fault]").count(), 1);
      await speed.fill("1.2");
      await speed.press("Tab");
      await said(page, /^2 segments/);
      assert.equal(await speed.getAttribute("aria-invalid"), null);
      await speed.fill("fast");
      await speed.press("Tab");
      await page.locator(".segments .fault", { hasText: "not a number" }).waitFor();
    },
    true,
  ));

test("the text can be changed: what is no script is said, unknown fields at their segment", () =>
  on(
    at({ segments: [WALK] }),
    async (page, asked) => {
      await performedOn(page);
      await page.getByText("Script as text").click();
      const text = page.locator(".script-text textarea");
      const whole = await text.inputValue();
      assert.deepEqual(JSON.parse(whole), { segments: [WALK] });
      await text.fill("{");
      await text.press("Tab");
      await page.locator(".fault", { hasText: "not JSON" }).waitFor();
      await text.fill(whole.replace('"start"', '"begin"'));
      await text.press("Tab");
      await page.locator(".segments [data-note=fault]", { hasText: "begin" }).waitFor();
      await text.fill(whole.replace("[0, 3]", "[1, 4]"));
      await text.press("Tab");
      await said(page, /^1 segment/);
      assert.deepEqual(asked.at(-1)!.segments[0]!["to"], [1, 4]);
    },
    true,
  ));

test("the link shows the same performance; another time is another picture", () =>
  on(at({ segments: [WALK, TURN] }), async (page) => {
    await performedOn(page);
    const first = await picture(page);
    await page.getByRole("button", { name: /^Follow/ }).click();
    await page.keyboard.press("End");
    const last = await picture(page);
    assert.ok(!first.equals(last));
    await page.keyboard.press("Home");
    assert.ok(first.equals(await picture(page)), "the first pose again");
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

test("a target that is added is where the joint is, so that the act still can be performed", () =>
  on(at({ segments: [{ kind: "act", model: "reaching" }] }), async (page, asked) => {
    await performedOn(page);
    await page.getByRole("button", { name: "Add a target" }).click();
    await until(async () => asked.at(-1)!.segments[0]!["targets"] !== undefined, "it is asked for");
    await page.locator("fieldset", { hasText: "Target 1" }).waitFor();
    await until(
      async () => (await page.locator("#stage[data-performed]").count()) === 1,
      "the motion is there",
    );
    await page.waitForTimeout(500);
    assert.equal(await page.locator("[data-note=fault]").count(), 0);
    const [target] = asked.at(-1)!.segments[0]!["targets"] as { position: number[] }[];
    assert.ok(target!.position.every(Number.isFinite));
    await page.getByRole("button", { name: "Delete target 1" }).click();
    await until(async () => !("targets" in asked.at(-1)!.segments[0]!), "it is gone");
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
    const page = await chromium.newPage({
      viewport: { width, height },
      colorScheme,
      bypassCSP: true,
    });
    await page.goto(SERVICE + at({ segments: [WALK, TURN, { kind: "hold", seconds: 1 }] }));
    await performedOn(page);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(wide <= 0, `${wide} px too wide`);
    assert.deepEqual(await broken(page), []);
    await page.getByText("Whole performance").click();
    await page.getByText("Script as text").click();
    await page.getByRole("button", { name: /^Draw path/ }).click();
    for (const segment of [1, 2]) {
      await page.locator(".segments .open").nth(segment).click();
      assert.deepEqual(await broken(page), []);
    }
    await page.evaluate(() => {
      document.querySelector(".script-text textarea")!.removeAttribute("id");
    });
    assert.match((await broken(page)).join(), /label/, "it would notice a field without a name");
    await page.close();
  });

/** Rules that are broken seriously, and where. */
async function broken(page: Page): Promise<string[]> {
  await page.evaluate(AXE);
  return page.evaluate(async () => {
    type Violation = { id: string; impact: string; nodes: { target: string[] }[] };
    const { axe } = window as unknown as { axe: { run(): Promise<{ violations: Violation[] }> } };
    const { violations } = await axe.run();
    return violations
      .filter(({ impact }) => impact === "serious" || impact === "critical")
      .map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target.join(" ")).join(", ")}`);
  });
}
