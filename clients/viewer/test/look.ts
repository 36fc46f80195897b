/** Readings of the page by a test: its picture, its numbers, and its questions. */

import type { Locator, Page } from "playwright-core";

/** The middle of the stage, when it has come to rest. */
export async function picture(page: Page): Promise<Buffer> {
  const box = (await page.locator("#stage").boundingBox())!;
  const clip = { x: box.x + 60, y: box.y + 60, width: box.width - 120, height: box.height - 150 };
  let before: Buffer = Buffer.of();
  for (let look = 0; look < 100; look++) {
    const drawing = await drawn(page);
    const shot = await page.screenshot({ clip });
    if ((await drawn(page)) !== drawing) continue;
    if (shot.equals(before)) return shot;
    before = shot;
    await page.waitForTimeout(200);
  }
  throw new Error("the stage does not come to rest");
}

/** Number of the drawing at rest, when it is on the screen. */
function drawn(page: Page): Promise<string> {
  // Reading a pixel waits for the drawing: on a busy machine the one before is shown until then.
  return page.locator("#stage canvas[data-rest]").evaluate((canvas: HTMLCanvasElement) => {
    const gl = canvas.getContext("webgl2")!;
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return canvas.dataset["rest"]!;
  });
}

export function slider(page: Page, control: string): Locator {
  return page.locator(`[data-control="${control}"] input[type=range]`);
}

export function typed(page: Page, control: string): Locator {
  return page.locator(`[data-control="${control}"] input[type=text]`);
}

/** Seconds that the transport shows. */
export async function time(page: Page): Promise<number> {
  return Number((await page.locator("[data-part=time] .time").textContent())!.split(" ")[0]);
}

/** In centimetres. */
export async function sigma(page: Page): Promise<number> {
  return Number.parseFloat((await page.locator("[data-sigma]").textContent())!);
}

/** Until the body is there, and the clip that it plays. */
export async function settled(page: Page): Promise<void> {
  await page.locator("#stage[data-clip]").waitFor();
  await page.waitForFunction(() => document.querySelector(".nearest li"));
}

export async function until(met: () => Promise<boolean>, what: string): Promise<void> {
  for (const began = performance.now(); performance.now() - began < 60_000; ) {
    if (await met()) return;
    await new Promise((done) => setTimeout(done, 100));
  }
  throw new Error(`within a minute it did not come true that ${what}`);
}
