/** A crowd that WebGPU computes and draws, beside the one that WebGL draws. */

import assert from "node:assert/strict";
import { after, before, describe, it } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, browserWithWebGpu, SERVICE } from "./harness.ts";
import { hideRenderer, lights, unlike, until } from "./look.ts";

// As many clips as a crowd has motions that are not computed here: both crowds move alike.
const STILL = "/#quadruped?~view=crowd&~playing=no&~time=0&~crowd=200";

interface Opened {
  readonly page: Page;
  readonly faults: string[];
  /** Paths that the page has asked for. */
  readonly asked: string[];
}

describe("the crowd of WebGPU", () => {
  let gpu: Browser;
  let plain: Browser;

  before(async () => {
    [gpu, plain] = await Promise.all([browserWithWebGpu(), browser()]);
  });
  after(() => Promise.all([gpu.close(), plain.close()]));

  async function crowd(from: Browser, hash: string, script?: () => void): Promise<Opened> {
    const own = await from.newContext({ viewport: { width: 1280, height: 720 } });
    // Where a processor draws, the page does not ask for WebGPU.
    await own.addInitScript(hideRenderer);
    if (script) await own.addInitScript(script);
    const page = await own.newPage();
    const [faults, asked]: [string[], string[]] = [[], []];
    page.on("pageerror", (fault) => faults.push(String(fault)));
    page.on("console", (line) => {
      if (line.type() === "error") faults.push(line.text());
    });
    page.on("request", (request) => asked.push(new URL(request.url()).pathname));
    await page.goto(SERVICE + hash);
    await counted(page);
    return { page, faults, asked };
  }

  async function counted(page: Page): Promise<void> {
    await page.locator(".crowd li b", { hasText: /\d/ }).first().waitFor({ timeout: 60_000 });
    await page.locator("#stage canvas[data-rest]").waitFor();
  }

  const canvases = (page: Page) => page.locator("#stage canvas").count();

  it("stands as that of WebGL does", async () => {
    const [computed, drawn] = [await crowd(gpu, STILL), await crowd(plain, STILL)];
    assert.deepEqual([await canvases(computed.page), await canvases(drawn.page)], [2, 1]);
    const [one, other] = [await lights(computed.page), await lights(drawn.page)];
    const apart = unlike(one, other);
    assert.ok(apart < 0.01, `${apart} of the picture differs`);
    // Negative control: the same crowd some steps later.
    await drawn.page.keyboard.press(" ");
    await drawn.page.waitForTimeout(700);
    await drawn.page.keyboard.press(" ");
    await drawn.page.locator("#stage canvas[data-rest]").waitFor();
    const later = unlike(one, await lights(drawn.page));
    assert.ok(later > 3 * apart, `${later} after ${apart}`);
    assert.deepEqual([computed.faults, drawn.faults], [[], []]);
    // Only browsers with WebGPU load its script.
    assert.ok(computed.asked.includes("/crowd-webgpu.js"));
    assert.ok(!drawn.asked.includes("/crowd-webgpu.js"));
    await Promise.all([computed.page.context().close(), drawn.page.context().close()]);
  });

  it("is drawn by WebGL where a processor draws", async () => {
    const page = await gpu.newPage();
    const asked: string[] = [];
    page.on("request", (request) => asked.push(new URL(request.url()).pathname));
    await page.goto(SERVICE + STILL);
    await counted(page);
    assert.equal(await canvases(page), 1);
    assert.ok(!asked.includes("/crowd-webgpu.js"));
    await page.close();
  });

  it("is as many as ten thousand, and leaves with its view", async () => {
    const { page, faults } = await crowd(gpu, "/#cmu_walk?~view=crowd&~playing=no&~crowd=10000");
    const counts = await page.locator(".crowd li b").allInnerTexts();
    assert.equal(
      counts.reduce((sum, each) => sum + Number(each), 0),
      10_000,
    );
    await page.getByRole("button", { name: "Single" }).click();
    await until(async () => (await canvases(page)) === 1, "the crowd's canvas is taken away");
    assert.deepEqual(faults, []);
    await page.context().close();
  });

  it("is drawn by WebGL where the kernel cannot be opened", async () => {
    const { page, asked } = await crowd(gpu, STILL, () => {
      GPUDevice.prototype.createComputePipelineAsync = () =>
        Promise.reject(new Error("too much memory"));
    });
    assert.equal(await canvases(page), 1);
    assert.ok(asked.includes("/crowd-webgpu.js"));
    await page.context().close();
  });

  it("is drawn by WebGL when the graphics card is lost", async () => {
    const { page } = await crowd(gpu, STILL, () => {
      // The browser does not lose it at will: the page is told that it was lost.
      const told = new Promise<GPUDeviceLostInfo>((done) => {
        Object.assign(window, { lose: () => done({ reason: "unknown" } as GPUDeviceLostInfo) });
      });
      Object.defineProperty(GPUDevice.prototype, "lost", { get: () => told });
    });
    assert.equal(await canvases(page), 2);
    await page.evaluate(() => (window as unknown as { lose: () => void }).lose());
    await until(async () => (await canvases(page)) === 1, "the crowd's canvas is taken away");
    await counted(page);
    await page.context().close();
  });

  it("is in the videos of the page", async () => {
    const { page } = await crowd(gpu, STILL, () => {
      const own = HTMLCanvasElement.prototype.captureStream;
      HTMLCanvasElement.prototype.captureStream = function (this: HTMLCanvasElement, ...words) {
        Object.assign(window, { filmed: this });
        return own.apply(this, words);
      };
    });
    await page.getByRole("button", { name: "Record video" }).click();
    await until(async () => (await colourful(page)) > 1000, "characters are in the film");
    await page.getByRole("button", { name: "Stop" }).click();
    await page.context().close();
  });
});

/** In the film of the page: pixels that are not grey, as the ground and what is behind it are. */
function colourful(page: Page): Promise<number> {
  return page.evaluate(() => {
    const film = (window as unknown as { filmed?: HTMLCanvasElement }).filmed;
    if (!film) return 0;
    const pen = Object.assign(document.createElement("canvas"), {
      width: film.width,
      height: film.height,
    }).getContext("2d")!;
    pen.drawImage(film, 0, 0);
    const { data } = pen.getImageData(0, 0, film.width, film.height);
    let count = 0;
    for (let at = 0; at < data.length; at += 4) {
      const [red, green, blue] = [data[at]!, data[at + 1]!, data[at + 2]!];
      if (Math.max(red, green, blue) - Math.min(red, green, blue) > 60) count++;
    }
    return count;
  });
}
