/** A model leaves nothing behind when another is shown, or the same one otherwise. */

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { Client } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { blank, browser, opened, SERVICE } from "./harness.ts";
import { picture, settled, until } from "./look.ts";

const client = new Client(SERVICE);

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

test("the graphics card is given back what a model took", async () => {
  const page = await blank(chromium, { viewport: { width: 640, height: 480 } });
  // Each geometry has buffers; those that are not disposed stay alive.
  await page.addInitScript(`
    globalThis.alive = 0;
    const own = WebGL2RenderingContext.prototype;
    for (const [name, by] of [["createBuffer", 1], ["deleteBuffer", -1]]) {
      const before = own[name];
      own[name] = function (...given) { globalThis.alive += by; return before.apply(this, given); };
    }`);
  await page.goto(`${SERVICE}/#reaching?~feet=yes`);
  await settled(page);
  const alive: number[] = [];
  for (let round = 0; round < 3; round++) {
    for (const [model, control] of [
      ["cmu_walk", "speed"],
      ["reaching", "target_height"],
    ] as const) {
      await page.getByLabel("Model", { exact: true }).selectOption(model);
      // A view that is chosen before the model is shown is that of the model before it.
      await page.locator(`[data-control="${control}"]`).waitFor();
      await page.getByRole("button", { name: "Compare all" }).click();
      await page.locator(".levels-now", { hasText: "px" }).first().waitFor();
      await page.getByRole("button", { name: "Crowd" }).click();
      await page.locator(".crowd[data-frame]").waitFor({ timeout: 60_000 });
      await people(page, "50");
      await people(page, "100");
    }
    alive.push(await page.evaluate("alive"));
  }
  assert.ok(alive[0]! > 10, `${alive}`);
  assert.equal(alive[2], alive[1]);
  await page.close();
});

test("who drags while the model is replaced may look around afterwards", async () => {
  const { page } = await opened(chromium, "/#reaching?~playing=no");
  await settled(page);
  const stage = (await page.locator("#stage").boundingBox())!;
  const at = (await page.locator('[data-part="target"]').getAttribute("data-handle"))!.split(" ");
  await page.mouse.move(stage.x + Number(at[0]), stage.y + Number(at[1]));
  await page.mouse.down();
  await page.mouse.move(stage.x + Number(at[0]), stage.y + Number(at[1]) - 20, { steps: 4 });
  await page.getByLabel("Model", { exact: true }).selectOption("cmu_walk");
  await page.locator('[data-control="speed"]').waitFor();
  await page.mouse.up();
  await settled(page);
  await page.getByRole("button", { name: "Pause (space)" }).click();
  const before = await picture(page);
  await page.mouse.move(stage.x + 100, stage.y + 100);
  await page.mouse.down();
  await page.mouse.move(stage.x + 300, stage.y + 130, { steps: 5 });
  await page.mouse.up();
  assert.ok(!before.equals(await picture(page)));
  await page.close();
});

test("feet slide as fast as the service says, and feet as predicted have no contacts", async () => {
  const { page } = await opened(chromium, "/#cmu_walk?~feet=yes&~playing=no");
  await settled(page);
  const skate = page.locator("[data-skate]");
  const card = await client.card("cmu_walk");
  const controls = Object.fromEntries(card.controls.map((each) => [each.name, each.default]));
  const { trust } = await client.clip("cmu_walk", { controls, fps: 60, loop: true });
  assert.equal(await skate.textContent(), `${(100 * trust.feet!.skate).toFixed(1)} cm/s`);
  await page.getByRole("button", { name: "Feet stand" }).click();
  await page.getByText("Feet as predicted: let them stand").waitFor();
  assert.equal(await skate.textContent(), "");
  await page.getByRole("button", { name: "Root motion" }).click();
  await page.getByText("In place, every foot slides").waitFor();
  await page.close();
});

async function people(page: Page, count: string): Promise<void> {
  await page.locator(".crowd input").first().fill(count);
  const counted = async () =>
    (await page.locator(".crowd li b").allInnerTexts()).reduce((all, one) => all + Number(one), 0);
  await until(async () => (await counted()) === Number(count), `there are ${count}`);
}
