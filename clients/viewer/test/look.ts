/** What a test reads from the page: its picture, its numbers, and what it was asked. */

import type { Locator, Page } from "playwright-core";

/** Size of a picture that is compared with another. */
const [WIDTH, HEIGHT] = [640, 360];

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
  return Number((await page.locator(".time").textContent())!.split(" ")[0]);
}

/** In centimetres. */
export async function sigma(page: Page): Promise<number> {
  return Number.parseFloat((await page.locator("[data-sigma]").textContent())!);
}

/** Until the body is there, and the clip that it plays. */
export async function settled(page: Page): Promise<void> {
  await page.waitForFunction(() => performance.getEntriesByName("posefield:first-pose").length > 0);
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

/** Brightness of the stage's pixels, small, so that smoothed edges do not count. */
export async function lights(page: Page): Promise<number[]> {
  const png = (await page.locator("#stage canvas").first().screenshot()).toString("base64");
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
export function unlike(one: readonly number[], other: readonly number[]): number {
  return one.filter((value, at) => Math.abs(value - other[at]!) > 25).length / one.length;
}

/** In the page: WebGL names another renderer than the one it has. */
export function hideRenderer(): void {
  const own = WebGL2RenderingContext.prototype.getParameter;
  WebGL2RenderingContext.prototype.getParameter = function (this: WebGL2RenderingContext, name) {
    return name === 0x9246 ? "a graphics card" : (own.call(this, name) as unknown);
  };
}
