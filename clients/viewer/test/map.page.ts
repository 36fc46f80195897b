/** The map of two controls: sigma as the service says, dots, clicks, keys and words. */

import assert from "node:assert/strict";
import { after, before, describe, it } from "node:test";

import { Client, type ModelCard } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { Frame, MARGIN } from "../src/chart.ts";
import { browser, opened, SERVICE } from "./harness.ts";

const client = new Client(SERVICE);
const FIGURE = /[−-]?[\d.]+/g;

describe("the map", () => {
  let from: Browser;
  let page: Page;
  let card: ModelCard;
  let faults: string[];

  before(async () => {
    from = await browser();
    ({ page, faults } = await opened(from, "/#reaching"));
    card = await client.card("reaching");
    await page.locator(".map").getByLabel("across", { exact: true }).selectOption("turn");
    await page.locator(".map").getByLabel("up", { exact: true }).selectOption("target_height");
    await page.locator(".map-words", { hasText: "Within" }).waitFor();
    await settled(page, "turn");
  });
  after(() => from.close());

  const here = async (): Promise<number[]> => {
    const said = await page.locator(".map-here").innerText();
    return [...said.split(";")[0]!.matchAll(FIGURE)].map(([text]) =>
      Number(text!.replace("−", "-")),
    );
  };
  const box = async () => {
    await page.locator(".map-canvas").scrollIntoViewIfNeeded();
    return (await page.locator(".map-canvas").boundingBox())!;
  };
  const control = (name: string) => card.controls.find((each) => each.name === name)!;
  const frame = async () => {
    const { width, height } = await box();
    return new Frame(control("turn"), control("target_height"), width, height);
  };
  const at = async (turn: number, height: number) => {
    const [place, { x, y }] = [await frame(), await box()];
    return [x + place.x(turn), y + place.y(height)] as const;
  };

  it("says the least and the greatest sigma that the service answers with", async () => {
    const question = {
      across: "turn",
      along: "target_height",
      columns: 48,
      rows: 36,
      margin: MARGIN,
    };
    const grid = await client.sigma("reaching", question);
    const inside = grid.sigma.flatMap((row, i) => row.filter((_, j) => grid.inside[i]![j]));
    const [least, most] = [100 * Math.min(...inside), 100 * Math.max(...inside)];
    const words = await page.locator(".map-words").innerText();
    const [low, high] = [...words.matchAll(/([\d.]+) cm/g)].map(([, text]) => Number(text));
    assert.ok(Math.abs(low! - least) < 0.006 * least, `${low} for ${least}`);
    assert.ok(Math.abs(high! - most) < 0.006 * most, `${high} for ${most}`);
    assert.ok(Math.abs(most - least) > 0.006 * most);
  });

  it("goes where one clicks and drags", async () => {
    // Beyond what was sampled there is no dot to be meant instead.
    const { minimum, maximum } = control("turn");
    const beyond = minimum - 0.15 * (maximum - minimum);
    await page.mouse.click(...(await at(beyond, 1.2)));
    const [turn, height] = await here();
    assert.ok(
      Math.abs(turn! - beyond) < 1.5 && Math.abs(height! - 1.2) < 0.03,
      `${turn} ${height}`,
    );
    await page.mouse.move(...(await at(0, 1.4)));
    await page.mouse.down();
    await page.mouse.move(...(await at(60, 0.5)), { steps: 4 });
    await page.mouse.up();
    const [later, lower] = await here();
    assert.ok(Math.abs(later! - 60) < 1.5 && Math.abs(lower! - 0.5) < 0.03, `${later} ${lower}`);
  });

  it("moves by arrows and goes to examples by page keys", async () => {
    await page.locator(".map-canvas").focus();
    const before = await here();
    await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("ArrowUp");
    const now = await here();
    const { minimum, maximum } = control("turn");
    assert.ok(Math.abs(before[0]! - now[0]! - 0.02 * (maximum - minimum)) < 0.2);
    assert.ok(now[1]! > before[1]!);
    await page.keyboard.press("PageDown");
    assert.match(await page.locator(".map-here").innerText(), /, exactly$/);
    await page.keyboard.press("Shift+ArrowRight");
    assert.doesNotMatch(await page.locator(".map-here").innerText(), /exactly/);
  });

  it("names a captured clip under the pointer and goes to all of its controls", async () => {
    const [x, y] = ["turn", "target_height"].map((name) =>
      card.controls.findIndex((each) => each.name === name),
    );
    const values = card.examples[40]!;
    const place = await at(values[x!]!, values[y!]!);
    await page.mouse.move(...place);
    await page.locator(".map-tip").waitFor({ state: "visible" });
    assert.match(await page.locator(".map-tip").innerText(), /reach_\d+\.bvh/);
    await page.mouse.click(...place);
    assert.match(await page.locator(".map-here").innerText(), /reach_\d+\.bvh, exactly$/);
    await page.mouse.move(5, 5);
    await page.locator(".map-tip").waitFor({ state: "hidden" });
  });

  it("is drawn anew where other controls change", async () => {
    await page.locator(".map-canvas").focus();
    await page.keyboard.press("Home");
    const before = await page.locator(".map-words").innerText();
    for (let i = 0; i < 10; i++) await page.keyboard.press("PageDown");
    await page.waitForFunction(
      (text) => document.querySelector(".map-words")!.textContent !== text,
      before,
    );
  });

  it("has a table for who does not see it, and exchanges its axes", async () => {
    await page.getByText("Sigma as a table").click();
    assert.equal(await page.locator(".map tbody tr").count(), 6);
    await page.locator(".map").getByLabel("across", { exact: true }).selectOption("target_height");
    await settled(page, "target_height");
    assert.equal(await page.locator(".map").getByLabel("up", { exact: true }).inputValue(), "turn");
    assert.match(
      await page.locator(".map caption").innerText(),
      /Columns: target_height, rows: turn/,
    );
  });

  it("and nothing went wrong unnoticed", () => assert.deepEqual(faults, []));
});

async function settled(page: Page, across: string): Promise<void> {
  await page
    .locator(".map caption", { hasText: `Columns: ${across}` })
    .waitFor({ state: "attached" });
}
