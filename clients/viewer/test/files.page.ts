/** The clip as a file: what is saved is what the service sends, and what curl and Python get. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, describe, it } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, opened, SERVICE } from "./harness.ts";

const PYTHON = join(
  dirname(process.env["POSEFIELD_COMMAND"] ?? "../../.venv/bin/posefield"),
  "python",
);
const FORMATS = ["usdc", "usda", "usdz", "glb", "bvh", "npz", "json"];

describe("files", () => {
  let from: Browser;
  let page: Page;
  let faults: string[];
  const folder = mkdtempSync(join(tmpdir(), "posefield-files-"));

  before(async () => {
    from = await browser();
    ({ page, faults } = await opened(from, "/#cmu_walk"));
    await page.locator(".files pre", { hasText: "curl" }).waitFor();
  });
  after(() => from.close());

  const choose = (name: string, value: string) =>
    page.locator(".files").getByLabel(name, { exact: true }).selectOption(value);
  const said = (text: RegExp) => page.locator(".files-said", { hasText: text }).waitFor();
  const text = async (kind: string) => {
    await page.locator(".files").getByRole("button", { name: kind, exact: true }).click();
    return page.locator(".files pre").innerText();
  };
  const download = async (): Promise<Buffer> => {
    const [got] = await Promise.all([
      page.waitForEvent("download"),
      page.locator(".files-get").click(),
    ]);
    await said(/saved: /);
    return readFileSync(await got.path());
  };

  it("of every format are saved whole, as the link gives them", async () => {
    const sizes = new Set<number>();
    for (const format of FORMATS) {
      await choose("Format", format);
      const found = await download();
      const answer = await fetch(await text("Link"));
      assert.deepEqual(found, Buffer.from(await answer.arrayBuffer()), format);
      sizes.add(found.length);
    }
    assert.equal(sizes.size, FORMATS.length);
  });

  it("say what was chosen, and curl and Python get the same", async () => {
    await choose("Format", "usda");
    await choose("Up axis", "z");
    await choose("Unit", "cm");
    await page.getByRole("button", { name: "Root motion" }).click();
    await page.getByLabel("Level", { exact: true }).selectOption("1");
    await choose("Joint names", "mixamo");
    await page.locator(".files").getByLabel("Closed loop").check();
    await page.locator(".files").getByLabel("Frames a second").fill("24");
    await page.locator(".files").getByLabel("Frames a second").press("Tab");
    const found = await download();
    const usda = found.toString();
    for (const word of [
      /upAxis = "Z"/,
      /metersPerUnit = 0.01/,
      /mixamorig/,
      /timeCodesPerSecond = 24/,
    ]) {
      assert.match(usda, word);
    }
    execFileSync("sh", ["-c", await text("curl")], { cwd: folder, stdio: "pipe" });
    assert.deepEqual(readFileSync(join(folder, "cmu_walk.usda")), found);
  });

  it("Python's client saves the same", async () => {
    const found = await download();
    const own = mkdtempSync(join(tmpdir(), "posefield-python-"));
    execFileSync(PYTHON, ["-c", await text("Python")], { cwd: own, stdio: "pipe" });
    assert.deepEqual(readFileSync(join(own, "cmu_walk.usda")), found);
  });

  it("copies the text that is shown", async () => {
    await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
    for (const kind of ["Link", "curl"]) {
      const shown = await text(kind);
      await page.locator(".files").getByRole("button", { name: "Copy" }).click();
      await said(/Copied/);
      assert.equal(await page.evaluate(() => navigator.clipboard.readText()), shown);
    }
  });

  it("keeps the focus where something is chosen by keys", async () => {
    const format = page.locator(".files").getByLabel("Format", { exact: true });
    await format.focus();
    const before = await format.inputValue();
    for (const [key, same] of [
      ["ArrowUp", false],
      ["ArrowDown", true],
    ] as const) {
      await page.keyboard.press(key);
      assert.equal((await format.inputValue()) === before, same);
      assert.ok(await format.evaluate((field) => field === document.activeElement));
    }
  });

  it("are not saved where the service is lost or one says stop", async () => {
    let saved = 0;
    page.on("download", () => saved++);
    await page.route(/clip\.usda/, (route) => route.abort());
    await page.locator(".files-get").click();
    await said(/Nothing was saved/);
    await page.unroute(/clip\.usda/);
    await page.route(/clip\.usda/, () => undefined);
    await page.locator(".files-get").click();
    await said(/Requesting/);
    await page.locator(".files-get", { hasText: "Stop" }).click();
    await said(/Stopped; nothing was saved/);
    await page.unroute(/clip\.usda/);
    assert.equal(saved, 0);
    await download();
    assert.equal(saved, 1);
  });

  it("of a crowd is the crowd, and curl and Python get the same", async () => {
    const { page: crowd } = await opened(from, "/#cmu_walk?~view=crowd&~crowd=50&~varied=yes");
    const files = crowd.locator(".files");
    await files.getByLabel("Format", { exact: true }).selectOption("usdz");
    assert.ok(await files.locator("option[value=glb]").evaluate((it: HTMLElement) => it.hidden));
    for (const [name, value] of [
      ["Seconds", "1"],
      ["Seed", "7"],
    ] as const) {
      await files.getByLabel(name).fill(value);
      await files.getByLabel(name).press("Tab");
    }
    const [got] = await Promise.all([
      crowd.waitForEvent("download"),
      crowd.locator(".files-get", { hasText: "Download crowd.usdz" }).click(),
    ]);
    const found = readFileSync(await got.path());
    assert.equal(got.suggestedFilename(), "crowd.usdz");
    const own = mkdtempSync(join(tmpdir(), "posefield-crowd-"));
    for (const [kind, program, ...words] of [
      ["curl", "sh", "-c"],
      ["Python", PYTHON, "-c"],
    ] as const) {
      await files.getByRole("button", { name: kind, exact: true }).click();
      const text = await files.locator("pre").innerText();
      assert.match(text, /count=50.*seconds=1.*seed=7.*take="?index/s);
      execFileSync(program, [...words, text], { cwd: own, stdio: "pipe" });
      assert.deepEqual(readFileSync(join(own, "crowd.usdz")), found, kind);
    }
    await crowd.goto(`${SERVICE}/#reaching?~view=crowd`);
    await crowd.getByText("There is no file of this crowd: this model does not walk.").waitFor();
    assert.ok(await crowd.locator(".files-get").isDisabled());
    await crowd.close();
  });

  it("and nothing else went wrong unnoticed", () => {
    assert.deepEqual(
      faults.filter((line) => !/ERR_FAILED|ERR_ABORTED/.test(line)),
      [],
    );
  });
});
