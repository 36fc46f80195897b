/** The page of `posefield page` from a static host: it moves soon, is steered, and loads nothing else. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createReadStream, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { tmpdir } from "node:os";
import { extname } from "node:path";
import { after, before, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { blank, browser } from "../../viewer/test/harness.ts";

const COMMAND = process.env["POSEFIELD_COMMAND"] ?? "posefield";
const TYPES: Record<string, string> = {
  ...{ ".html": "text/html", ".js": "text/javascript", ".css": "text/css" },
  ...{ ".wasm": "application/wasm", ".json": "application/json" },
};
/** Seconds of all processors until a character moves, with WebAssembly in the browser's cache. */
const SOON = 3;
const PHONE = { width: 400, height: 700 };
const folder = mkdtempSync(`${tmpdir()}/posefield-page-`);

let chromium: Browser;
let server: Server;
let page: Page;
let address: string;
const faults: string[] = [];
const requests: string[] = [];
before(async () => {
  execFileSync(COMMAND, ["page", "cmu_walk", "hdm05_kick", "-o", `${folder}/any/where`]);
  server = createServer((request, response) => {
    const path = new URL(request.url!, "http://host").pathname.replace(/\/$/, "/index.html");
    response.setHeader("content-type", TYPES[extname(path)] ?? "application/octet-stream");
    response.setHeader("cache-control", "max-age=600");
    createReadStream(folder + path)
      .on("error", () => response.writeHead(404).end())
      .pipe(response);
  });
  await new Promise<void>((ready) => server.listen(0, "127.0.0.1", ready));
  address = `http://127.0.0.1:${(server.address() as AddressInfo).port}/any/where/`;
  chromium = await browser();
  page = await blank(chromium, { viewport: { width: 900, height: 560 } });
  page.on("pageerror", (fault) => faults.push(String(fault)));
  page.on("console", (line) => {
    if (line.type() === "error") faults.push(line.text());
  });
  page.on("request", (request) => requests.push(request.url()));
  await moving();
});
after(async () => {
  await chromium.close();
  server.close();
  rmSync(folder, { recursive: true });
});

/** Load the page: milliseconds and the browser's processor seconds until a character moves. */
async function moving(): Promise<[number, number]> {
  await page.goto("about:blank");
  const before = await seconds();
  await page.goto(`${address}?from=test`);
  await page.waitForFunction(() => performance.getEntriesByName("moving").length > 0);
  const spent = (await seconds()) - before;
  return [await page.evaluate(() => performance.getEntriesByName("moving")[0]!.startTime), spent];
}

async function seconds(): Promise<number> {
  const session = await chromium.newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  await session.detach();
  return processInfo.reduce((sum, { cpuTime }) => sum + cpuTime, 0);
}

/** True as soon as two pictures of a page are the same. */
async function stands(shown: Page, tries = 60): Promise<boolean> {
  for (let again = 0; again < tries; again++) {
    const before = await shown.screenshot();
    await shown.waitForTimeout(100);
    if (before.equals(await shown.screenshot())) return true;
  }
  return false;
}

async function pictures(name: string): Promise<Buffer> {
  const path = process.env["POSEFIELD_PICTURES"];
  return page.screenshot(path ? { path: `${path}/${name}.png` } : {});
}

test("a character moves soon", async (context) => {
  const loads = [];
  for (let load = 0; load < 5; load++) loads.push(await moving());
  loads.sort(([, a], [, b]) => a - b);
  for (const [time, spent] of loads)
    context.diagnostic(
      `first moving character after ${time.toFixed()} ms, ${spent.toFixed(2)} s of CPU`,
    );
  assert.ok(loads[0]![1] < SOON, `${loads[0]![1]} s`);
  const before = await pictures("clip");
  await page.waitForTimeout(200);
  assert.ok(!before.equals(await pictures("clip-later")));
});

test("a slider changes the motion", async () => {
  const slider = page.locator("input[type=range]").first();
  const before = await slider.evaluate((input: HTMLInputElement) => input.value);
  await slider.focus();
  for (let times = 0; times < 20; times++) await page.keyboard.press("ArrowRight");
  assert.notEqual(await slider.evaluate((input: HTMLInputElement) => input.value), before);
});

test("a view shows what acts in it", async () => {
  const shown = () =>
    page
      .locator("#panel label:visible")
      .evaluateAll((labels) => labels.map((label) => label.firstChild!.textContent!.split(",")[0]));
  const always = ["Performer", "Level of detail"];
  const controls = ["speed", "turn", "stride_length"];
  const clip = ["Model", "View", ...controls, ...always, "Feet", "Body"];
  assert.deepEqual(await shown(), clip);
  await page.getByLabel("View").selectOption("walk");
  assert.deepEqual(await shown(), ["Model", "View", "speed", ...always, "Body", "Walkers"]);
  assert.ok(await page.getByRole("button", { name: "Download GLB" }).isHidden());
  await page.getByLabel("View").selectOption("clip");
  assert.deepEqual(await shown(), clip);
});

test("a clip is saved as binary glTF with a skin and an animation", async () => {
  const saved = page.waitForEvent("download");
  await page.getByRole("button", { name: "Download GLB" }).click();
  const content = readFileSync(await (await saved).path());
  assert.equal(content.toString("latin1", 0, 4), "glTF");
  const document = JSON.parse(content.toString("utf8", 20, 20 + content.readUInt32LE(12)));
  assert.equal(document.animations.length, 1);
  assert.equal(document.skins[0].joints.length, 31);
});

test("a walker goes where keys send it, and a crowd walks", async (context) => {
  await page.getByLabel("View").selectOption("walk");
  await page.locator("#told", { hasText: "Arrow keys" }).waitFor();
  await page.getByLabel("View").blur();
  await page.locator("input[type=range]").first().click();
  await page.keyboard.down("ArrowUp");
  for (const name of ["walk-1", "walk-2", "walk-3", "walk-4"]) {
    await page.waitForTimeout(350);
    await pictures(name);
  }
  assert.ok(!(await stands(page, 3)));
  // A key that is released elsewhere is no longer pressed.
  await page.locator("input[type=range]").first().focus();
  await page.keyboard.up("ArrowUp");
  assert.ok(await stands(page));
  await pictures("walk-stopped");
  // A drag turns the view, and moves no walker.
  await page.mouse.move(200, 250);
  await page.mouse.down();
  await page.mouse.move(320, 260, { steps: 4 });
  await page.mouse.up();
  assert.ok(await stands(page));
  await page.locator("input[type=range]").last().fill("40");
  await page.waitForTimeout(1500);
  await pictures("crowd");
  context.diagnostic(`${requests.length} requests`);
});

test("the button Back of the browser shows the model before", async () => {
  await page.getByLabel("Model").selectOption("hdm05_kick");
  await page.locator("#told", { hasText: "kick" }).waitFor();
  await page.goBack();
  await page.locator("#told", { hasText: "Walking" }).waitFor();
  assert.equal(await page.getByLabel("Model").inputValue(), "cmu_walk");
});

test("a model that the page does not have is told in a sentence", async () => {
  const names = ["walk", "cmu_walk"];
  const sentences = ["This page has no model walk: this is cmu_walk.", "Walking"];
  for (const [index, name] of names.entries()) {
    await page.goto(`${address}#${name}`);
    await page.locator("#told", { hasText: sentences[index]! }).waitFor();
    assert.equal(await page.getByLabel("Model").inputValue(), "cmu_walk");
  }
});

test("a finger on the disc steers a walker", async () => {
  const phone = await blank(chromium, { hasTouch: true, isMobile: true, viewport: PHONE });
  await phone.goto(address);
  await phone.getByLabel("View").selectOption("walk");
  const disc = (await phone.locator(".disc").boundingBox())!;
  assert.ok(await stands(phone));
  await phone.mouse.move(disc.x + disc.width / 2, disc.y + 4);
  await phone.mouse.down();
  await phone.waitForTimeout(1000);
  const path = process.env["POSEFIELD_PICTURES"];
  await phone.screenshot(path ? { path: `${path}/disc.png` } : {});
  assert.ok(!(await stands(phone, 3)));
  await phone.mouse.up();
  assert.ok(await stands(phone));
  await phone.close();
});

test("a file that is missing, or another one, is told in a sentence", async () => {
  const site = `${folder}/any/where`;
  for (const [change, sentence] of [
    [
      () => writeFileSync(`${site}/models/cmu_walk.glb`, "?"),
      /^models\/cmu_walk\.glb .* not the file/,
    ],
    // As hosts answer that have one page for all addresses.
    [
      () => writeFileSync(`${site}/models.json`, "<!doctype html>"),
      /^models\.json is another file/,
    ],
    [() => rmSync(`${site}/models.json`), /^models\.json cannot be loaded: status 404\.$/],
  ] as const) {
    change();
    // Without the cache of another page.
    const fresh = await blank(chromium);
    await fresh.goto(address);
    await fresh.locator("#told", { hasText: sentence }).waitFor();
    await fresh.close();
  }
});

test("nothing is loaded from elsewhere, and nothing goes wrong", () => {
  const others = requests.filter(
    (url) => !url.startsWith(address) && !/^(data|blob|about):/.test(url),
  );
  assert.deepEqual(others, []);
  assert.deepEqual(faults, []);
});
