/** Durations, printed; three times the goals is too long on any machine. */

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import type { Browser } from "playwright-core";

import { browser, opened } from "./harness.ts";
import { settled } from "./look.ts";

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

test("from opening to the first clip", async (context) => {
  const found: number[] = [];
  for (let round = 0; round < 3; round++) {
    const { page } = await opened(chromium);
    await settled(page);
    found.push(Math.round(await page.evaluate(() => performance.now())));
    await page.close();
  }
  context.diagnostic(`first clip: ${found.join(", ")} ms`);
  assert.ok(Math.min(...found) < 4500, `${found} ms`);
});

test("from a slider's movement to the pose", async (context) => {
  const { page } = await opened(chromium, "/#reaching?~playing=no&~time=0.5");
  await settled(page);
  // From each movement to the frame after the first answer that was asked for later.
  await page.evaluate(() => {
    const [took, fetched] = [[] as number[], window.fetch];
    let open: number[] = [];
    document.addEventListener("input", () => open.push(performance.now()), true);
    window.fetch = async (...words) => {
      const began = performance.now();
      const answer = await fetched(...words);
      if (/pose/.test(String(words[0])))
        requestAnimationFrame((now) => {
          took.push(...open.filter((since) => since <= began).map((since) => now - since));
          open = open.filter((since) => since > began);
        });
      return answer;
    };
    Object.assign(window, { took });
  });
  const track = page.locator('[data-control="target_height"] input[type=range]');
  const { x, y, width, height } = (await track.boundingBox())!;
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  for (let i = 0; i < 90; i++) {
    await page.mouse.move(x + width * (0.5 + 0.3 * Math.sin(i / 9)), y + height / 2);
    await page.waitForTimeout(16);
  }
  await page.mouse.up();
  await page.waitForTimeout(500);
  const took = await page.evaluate(() => (window as unknown as { took: number[] }).took);
  took.sort((a, b) => a - b);
  const at = (share: number) => took[Math.floor(share * took.length)]!.toFixed(0);
  context.diagnostic(
    `drag: ${took.length} movements, median ${at(0.5)} ms, nine in ten ${at(0.9)} ms`,
  );
  assert.ok(took.length > 10, `${took.length} movements of 90 were answered`);
  assert.ok(Number(at(0.5)) < 150, `${at(0.5)} ms`);
  await page.close();
});

test("frames of a crowd of 300 that walks", async (context) => {
  const { page } = await opened(chromium, "/#cmu_walk?~view=crowd&~crowd=300&~playing=yes");
  await settled(page);
  await page.waitForTimeout(4000);
  const times = await page.evaluate(
    () =>
      new Promise<number[]>((done) => {
        const found: number[] = [];
        const step = (now: number) => {
          found.push(now);
          if (now - found[0]! < 5000) requestAnimationFrame(step);
          else done(found);
        };
        requestAnimationFrame(step);
      }),
  );
  const took = times.slice(1).map((time, i) => time - times[i]!);
  took.sort((a, b) => a - b);
  const rate = (1000 * took.length) / (times.at(-1)! - times[0]!);
  const fine = await page.locator("#stage canvas").evaluate((it: HTMLCanvasElement) => it.width);
  context.diagnostic(
    `crowd: ${rate.toFixed(0)} frames a second, half of them within ${took[took.length >> 1]!.toFixed(0)} ms, ${fine} pixels wide`,
  );
  await page.close();
});
