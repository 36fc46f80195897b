/** Writes the pictures of docs/guide/page.md: `node test/screens.ts ../../docs` beside a service. */

import { join } from "node:path";

import { browser, opened } from "./harness.ts";
import { settled } from "./look.ts";

const SHOWN = {
  "page-one":
    "/#hdm05_grab_high?target_height=1.7&target_forward=0.7&target_left=-0.1&~playing=no&~time=0.9&~ghost=yes",
  "page-levels": "/#cmu_walk?speed=1.3&turn=0&stride_length=1.4&~playing=no&~time=0.2&~view=levels",
  "page-performance": `/#cmu_walk?~playing=no&~view=performance&~script=${encodeURIComponent(
    JSON.stringify({
      segments: [
        {
          kind: "walk",
          model: "cmu_walk",
          along: [
            [0.2, 2],
            [1.2, 5],
          ],
          start: "standing",
        },
        { kind: "walk", model: "cmu_walk", seconds: 4, speed: 1.4, stop: "standing" },
      ],
    }),
  )}`,
  "page-crowd": "/#cmu_walk?speed=1.3&turn=0&stride_length=1.4&~playing=no&~view=crowd",
};

const [folder = "."] = process.argv.slice(2);
const chromium = await browser();
for (const [name, path] of Object.entries(SHOWN)) {
  const { page } = await opened(chromium, path);
  if (name === "page-performance") await page.locator("#stage[data-performed]").waitFor();
  else await settled(page);
  if (name === "page-performance") {
    const time = page.getByLabel("Time in the performance");
    await time.fill("4");
    await time.blur();
  }
  if (name === "page-one") await page.getByRole("button", { name: "Map", exact: true }).click();
  await page.waitForTimeout(4000);
  await page.screenshot({ path: join(folder, `${name}.png`) });
  await page.close();
}
await chromium.close();
