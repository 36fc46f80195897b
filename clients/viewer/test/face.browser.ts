/** Curves in the page, against a running service with the procedural face (tests/interop/faces.py). */

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, opened, SERVICE } from "./harness.ts";
import { settled } from "./look.ts";

const LAUGH = { smile: 0.7, openness: 0.5 };
/** The page shows two decimals, and interpolates between frames. */
const SHOWN = 0.011;

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

function bars(page: Page): Promise<Record<string, number>> {
  return page.evaluate(() =>
    Object.fromEntries(
      [...document.querySelectorAll<HTMLElement>("[data-curve]")].map((output) => [
        output.dataset["curve"]!,
        Number.parseFloat(output.textContent!),
      ]),
    ),
  );
}

async function pose(time: number): Promise<{ names: string[]; values: number[] }> {
  const card = await (await fetch(`${SERVICE}/v1/models/face`)).json();
  const body = JSON.stringify({ controls: LAUGH, times: [time] });
  const headers = { "content-type": "application/json" };
  const asked = await fetch(`${SERVICE}/v1/models/face/pose`, { method: "POST", headers, body });
  const names = card.curves.map(({ name }: { name: string }) => name);
  return { names, values: (await asked.json()).curves[0] };
}

test("a bar for each curve shows its value at the time that is shown", async () => {
  for (const time of [0.3, 1]) {
    const path = `/#face?smile=0.7&openness=0.5&~playing=no&~time=${time}`;
    const { page, faults } = await opened(chromium, path);
    await settled(page);
    const { names, values } = await pose(time);
    const shown = await bars(page);
    assert.deepEqual(Object.keys(shown), names);
    names.forEach((name, index) => {
      assert.ok(Math.abs(shown[name]! - values[index]!) < SHOWN, `${name} at ${time} s`);
    });
    assert.deepEqual(faults, []);
    await page.close();
  }
});
