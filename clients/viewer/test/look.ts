/** Readings of the page by a test: its picture, its numbers, and its questions. */

import type { Locator, Page } from "playwright-core";

/** The middle of the stage, when it has come to rest. */
export async function picture(page: Page): Promise<Buffer> {
  const box = (await page.locator("#stage").boundingBox())!;
  const clip = { x: box.x + 60, y: box.y + 60, width: box.width - 120, height: box.height - 150 };
  let before: Buffer = Buffer.of();
  for (let look = 0; look < 40; look++) {
    await page.locator("#stage canvas[data-rest]").waitFor();
    const now = await page.screenshot({ clip });
    if (now.equals(before)) return now;
    before = now;
    await page.waitForTimeout(200);
  }
  throw new Error("the stage does not come to rest");
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
  for (let look = 0; look < 100; look++) {
    if (await met()) return;
    await new Promise((done) => setTimeout(done, 100));
  }
  throw new Error(`within ten seconds it did not come true that ${what}`);
}
