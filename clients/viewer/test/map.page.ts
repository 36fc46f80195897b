/** The map of two controls: sigma as the service says, dots, clicks, keys and words. */

import assert from "node:assert/strict";
import { after, before, describe, it } from "node:test";

import { Client, type ModelCard } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { extent, Frame, MARGIN } from "../src/chart.ts";
import { viridis } from "../src/colours.ts";
import { browser, opened, SERVICE } from "./harness.ts";
import { until } from "./look.ts";

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
    await settled(page, "turn, rows: target_height");
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
  /** Values of the controls that are no axes, as their fields say. */
  const others = async () => {
    const hash = new URLSearchParams(new URL(page.url()).hash.split("?")[1]);
    const rest = card.controls.filter(({ name }) => !["turn", "target_height"].includes(name));
    return Object.fromEntries(
      rest.map((each) => [each.name, Number(hash.get(each.name) ?? each.default)]),
    );
  };
  const colour = (spot: readonly [number, number]): Promise<number[]> =>
    page.locator(".map-canvas").evaluate((canvas, [x, y]) => {
      const own = canvas as HTMLCanvasElement;
      const ratio = own.width / own.clientWidth;
      const pen = own.getContext("2d")!;
      return [...pen.getImageData(x! * ratio, y! * ratio, 1, 1).data.slice(0, 3)];
    }, spot);
  const gap = (one: readonly number[], other: readonly number[]) =>
    Math.max(...one.map((value, i) => Math.abs(value - other[i]!)));
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
    const said = async () => {
      const words = await page.locator(".map-words").innerText();
      return [...words.matchAll(/([\d.]+) cm/g)].map(([, text]) => Number(text));
    };
    // On a busy machine it may still say what its first axes had.
    for (let i = 0; i < 100 && !(Math.abs((await said())[0]! - least) < 0.006 * least); i++) {
      await page.waitForTimeout(100);
    }
    const [low, high] = await said();
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
    const tip = await page.locator(".map-tip").innerText();
    const index = card.sources.indexOf(tip.match(/reach_\d+\.bvh/)![0]);
    const said = Number(tip.match(/left out: ([\d.]+) cm away/)![1]);
    assert.ok(Math.abs(said - 100 * card.left_out![index]!) < 0.006 * said, tip);
    assert.ok(Math.abs(said - 100 * card.left_out![(index + 1) % 92]!) > 0.006 * said);
    await page.mouse.click(...place);
    assert.match(await page.locator(".map-here").innerText(), /reach_\d+\.bvh, exactly$/);
    await page.mouse.move(5, 5);
    await page.locator(".map-tip").waitFor({ state: "hidden" });
  });

  it("stays with a clip where the finger trembles, and goes along where it moves", async () => {
    const [x, y] = ["turn", "target_height"].map((name) =>
      card.controls.findIndex((each) => each.name === name),
    );
    const [left, top] = await at(card.examples[40]![x!]!, card.examples[40]![y!]!);
    await page.mouse.move(left, top);
    await page.mouse.down();
    await page.mouse.move(left + 2, top + 1);
    assert.match(await page.locator(".map-here").innerText(), /exactly$/);
    await page.mouse.move(left + 9, top + 1);
    assert.doesNotMatch(await page.locator(".map-here").innerText(), /exactly$/);
    await page.mouse.up();
    await page.mouse.move(5, 5);
  });

  /** What of the map is not of its sigma's colour; the address and the map may still be on their way. */
  const miscoloured = async (): Promise<string> => {
    const grid = await client.sigma("reaching", {
      across: "turn",
      along: "target_height",
      columns: 48,
      rows: 36,
      margin: MARGIN,
      controls: await others(),
    });
    const [x, y] = ["turn", "target_height"].map((name) =>
      card.controls.findIndex((each) => each.name === name),
    );
    const place = await frame();
    const [crossX, crossY] = [place.x((await here())[0]!), place.y((await here())[1]!)];
    const dots = card.examples.map(
      (values) => [place.x(values[x!]!), place.y(values[y!]!)] as const,
    );
    const cells = grid.along_values.flatMap((up, row) =>
      grid.across_values.map((right, column) => ({
        at: [place.x(right), place.y(up)] as const,
        sigma: grid.sigma[row]![column]!,
        inside: grid.inside[row]![column]!,
      })),
    );
    // Where no dot, no ring and no line of the cross lies.
    const bare = cells
      .filter(({ inside, at: [left, top] }) => {
        const far = dots.every((dot) => Math.hypot(dot[0] - left, dot[1] - top) > 11);
        return inside && far && Math.abs(left - crossX) > 10 && Math.abs(top - crossY) > 10;
      })
      .sort((a, b) => a.sigma - b.sigma);
    assert.ok(bare.length > 1, `${bare.length} bare places`);
    const [low, high] = extent(grid);
    const seen = [bare[0]!, bare.at(-1)!].map(async ({ at: spot, sigma }) => {
      const wanted = [0, 0, 0];
      viridis((sigma - low) / (high - low), wanted);
      return { wanted, found: await colour(spot) };
    });
    const [least, most] = await Promise.all(seen);
    const wrong = [least!, most!].filter(({ wanted, found }) => gap(wanted, found) >= 24);
    if (gap(least!.wanted, most!.wanted) <= 48) return "all colours alike";
    return wrong.map(({ wanted, found }) => `${found} for ${wanted}`).join("; ");
  };

  it("is coloured by sigma", async () => {
    let said = await miscoloured();
    for (let look = 0; look < 20 && said; look++) {
      await page.waitForTimeout(250);
      said = await miscoloured();
    }
    assert.equal(said, "");
  });

  it("keeps the focus where its axes are chosen by keys", async () => {
    const across = page.locator(".map").getByLabel("across", { exact: true });
    await across.focus();
    const before = await across.inputValue();
    await page.keyboard.press("ArrowUp");
    assert.notEqual(await across.inputValue(), before);
    assert.ok(await across.evaluate((field) => field === document.activeElement));
    await page.keyboard.press("ArrowDown");
    assert.equal(await across.inputValue(), before);
    await page.locator(".map").getByLabel("up", { exact: true }).selectOption("target_height");
    await settled(page, "turn, rows: target_height");
  });

  it("says aloud where one is once that rests", async () => {
    await page.locator(".map-canvas").focus();
    const said = page.locator(".map [aria-live]");
    const before = await said.innerText();
    for (let i = 0; i < 5; i++) await page.keyboard.press("ArrowRight");
    assert.equal(await said.innerText(), before);
    const now = await page.locator(".map-here").innerText();
    await page.waitForFunction(
      (text) => document.querySelector(".map [aria-live]")!.textContent === text,
      now,
    );
    assert.equal(await page.locator(".map output").count(), 0);
  });

  it("shows the answer to the later question where the earlier fails", async () => {
    const other = await opened(
      from,
      "/#reaching?turn=20&target_height=1&~across=turn&~along=target_height&~playing=no",
    );
    const words = other.page.locator(".map-words", { hasText: "Within" });
    await words.waitFor();
    const before = await words.innerText();
    let asked = 0;
    await other.page.route(/sigma/, async (route) => {
      asked += 1;
      if (asked > 1) return route.continue();
      await new Promise((done) => setTimeout(done, 1000));
      return route.abort();
    });
    const hips = other.page.locator('[data-control="hip_height"] input[type=range]');
    await hips.fill("100");
    await until(async () => asked === 1, "it is asked");
    await hips.fill("900");
    await until(async () => (await words.innerText()) !== before, "the later answer is shown");
    await other.page.close();
  });

  it("goes to a clip as who moved it", async () => {
    const walkers = await client.card("cmu_walk");
    const other = await opened(from, "/#cmu_walk?~playing=no");
    await other.page.locator(".map-words", { hasText: "Within" }).waitFor();
    await other.page.locator(".map-canvas").focus();
    await other.page.keyboard.press("PageDown");
    const said = await other.page.locator(".map-here").innerText();
    const index = walkers.sources.indexOf(said.match(/example (.*), exactly$/)![1]!);
    const who = walkers.performers[walkers.moved_by[index]!]!;
    assert.ok(who);
    assert.equal(await other.page.getByLabel("Performer").inputValue(), who);
    await other.page.close();
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
