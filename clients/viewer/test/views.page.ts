/** Levels side by side and the crowd: what they say is what the service says. */

import assert from "node:assert/strict";
import { after, before, describe, it } from "node:test";

import { Client, type ModelCard } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { choose, ladder, pixels } from "../src/detail.ts";
import { browser, opened, SERVICE } from "./harness.ts";
import { time, until } from "./look.ts";

const client = new Client(SERVICE);

describe("levels side by side", () => {
  let from: Browser;
  let page: Page;
  let card: ModelCard;
  let faults: string[];

  before(async () => {
    from = await browser();
    card = await client.card("cmu_walk");
    ({ page, faults } = await opened(from, "/#cmu_walk?~view=levels"));
    await page.locator(".levels-now", { hasText: "px" }).first().waitFor();
  });
  after(() => from.close());

  const texts = () => page.locator(".levels article").allInnerTexts();
  const worst = async () =>
    (await page.locator(".levels-now").allInnerTexts())
      .slice(1)
      .map((text) => Number(text.match(/worst ([\d.]+)/)![1]));

  it("say what each level is and costs", async () => {
    const said = await texts();
    assert.equal(said.length, card.levels.length);
    for (const [level, { operations, bytes }] of card.levels.entries()) {
      assert.ok(said[level]!.includes(operations.toLocaleString("en")), said[level]);
      assert.ok(said[level]!.includes(`${Number((bytes / 1000).toPrecision(3))} kB`), said[level]);
    }
    assert.notEqual(said[0], said[1]);
  });

  it("say how far off each is as it is seen, more the nearer one looks", async () => {
    const far = await worst();
    assert.ok(far.every((value) => value > 0) && far[2]! > far[0]!, String(far));
    const { x, y, width, height } = (await page.locator("#stage canvas").boundingBox())!;
    await page.mouse.move(x + width / 2, y + height / 3);
    for (let i = 0; i < 6; i++) await page.mouse.wheel(0, -240);
    await page.waitForFunction(
      (before) => {
        const all = [...document.querySelectorAll(".levels-now")].slice(1);
        const now = all.map(({ textContent }) => Number(textContent.match(/worst ([\d.]+)/)![1]));
        return now.every((value, i) => value > before[i]!);
      },
      far,
      { timeout: 10_000 },
    );
  });

  it("say from where on nothing shows", async () => {
    const said = (await texts()).map((text) =>
      Number(text.match(/from ([\d,]+) m/)![1]!.replace(",", "")),
    );
    const { errors, radius } = ladder(card);
    const scale = (said[3]! - radius) / errors[3]!;
    for (const level of [1, 2]) {
      assert.ok(Math.abs(said[level]! - (errors[level]! * scale + radius)) <= 1.5, String(said));
    }
    assert.ok(said[3]! - said[1]! > 1.5);
  });

  it("and nothing went wrong unnoticed", () => assert.deepEqual(faults, []));
});

describe("the crowd", () => {
  let from: Browser;
  let page: Page;
  let faults: string[];

  before(async () => {
    from = await browser();
    ({ page, faults } = await opened(from, "/#cmu_walk?~view=crowd"));
    await page.locator(".crowd[data-frame]").waitFor({ timeout: 60_000 });
  });
  after(() => from.close());

  const counts = async () => (await page.locator(".crowd li b").allInnerTexts()).map(Number);
  const slide = (which: number, value: string) =>
    page.locator(".crowd input").nth(which).fill(value);
  const sum = (all: readonly number[]) => all.reduce((total, value) => total + value, 0);

  it("counts everybody by level", async () => {
    assert.equal(sum(await counts()), 300);
  });

  it("is coarser where more pixels may be off, and finer where fewer", async () => {
    await slide(1, "4");
    await until(async () => (await counts()).at(-1)! > 200, "most are at the coarsest");
    const coarse = await tinted(page);
    await slide(1, "-2");
    await until(async () => (await counts()).at(-1)! < 20, "few are at the coarsest");
    const finer = (all: readonly number[]) =>
      all[0]! > 2 * coarse[0]! && all[3]! < 0.5 * coarse[3]!;
    await until(async () => finer(await tinted(page)), `other colours than ${coarse}`);
    assert.equal(sum(await counts()), 300);
  });

  it("is as many as one says", async () => {
    for (const count of [50, 1000, 300]) {
      await slide(0, String(count));
      await until(async () => sum(await counts()) === count, `there are ${count}`);
    }
  });

  it("takes the levels that the service takes", async () => {
    const card = await client.card("cmu_walk");
    const own = ladder(card);
    const camera = { position: [1, 1.7, -4], fov: 0.8, height: 720 };
    const position = Array.from({ length: 200 }, (_, i) => [(13 * i) % 70, 0, (29 * i) % 90]);
    const previous = position.map((_, i) => i % card.levels.length);
    const controls = Object.fromEntries(card.controls.map((each) => [each.name, each.default]));
    const asked = { controls, time: 0, position, camera, level: "auto" as const, pixels: 2 };
    const levels = (limit: number, held: readonly number[] | null) =>
      position.map((at, i) => {
        const far = Math.hypot(
          ...at.map((x, axis) => x + own.middle[axis]! - camera.position[axis]!),
        );
        return choose(own.errors, pixels(camera) / (far - own.radius), limit, held?.[i] ?? -1);
      });
    const { levels: theirs } = await client.crowd("cmu_walk", asked);
    assert.deepEqual(levels(2, null), [...theirs]);
    assert.notDeepEqual(levels(2.2, null), [...theirs]);
    const { levels: held } = await client.crowd("cmu_walk", { ...asked, previous_level: previous });
    assert.deepEqual(levels(2, previous), [...held]);
    assert.notDeepEqual([...held], [...theirs]);
  });

  it("moves", async () => {
    const shot = () => page.locator("#stage canvas").screenshot();
    const before = await shot();
    await until(async () => !(await shot()).equals(before), "the picture is another");
  });

  it("goes on where the clip of one body ends", async () => {
    const other = await opened(from, "/#cmu_walk?~view=crowd&~loop=no&~speed=2");
    const times: number[] = [];
    await until(async () => {
      times.push(await time(other.page));
      return times.some((later, i) => later < (times[i - 1] ?? 0));
    }, "time begins anew");
    await other.page.getByRole("button", { name: "Pause (space)" }).waitFor();
    await other.page.keyboard.press(" ");
    await other.page.getByRole("button", { name: "Play (space)" }).waitFor();
    await other.page.close();
  });

  it("is loaded again when the service is back", async () => {
    const other = await opened(from, "/#cmu_walk");
    await other.page.locator(".nearest li").first().waitFor();
    await other.page.route(/crowd.msgpack|readyz/, (route) => route.abort("connectionreset"));
    await other.page.getByRole("button", { name: "Crowd" }).click();
    await other.page
      .getByText(/motions could not be computed. The service does not answer/)
      .waitFor();
    await other.page.unroute(/crowd.msgpack|readyz/);
    await other.page.locator(".crowd[data-frame]").waitFor({ timeout: 60_000 });
    await other.page.close();
  });

  it("of a model that does not walk stays and says so", async () => {
    const other = await opened(from, "/#reaching?~view=crowd");
    await other.page.locator(".crowd[data-frame]").waitFor({ timeout: 60_000 });
    assert.match(await other.page.locator(".crowd").innerText(), /does not walk/);
    assert.deepEqual(other.faults, []);
    await other.page.close();
  });

  it("and nothing went wrong unnoticed", () => assert.deepEqual(faults, []));
});

/** Pixels of the stage in each level's colour, by hue alone: a character's sides are darker. */
async function tinted(page: Page): Promise<number[]> {
  const png = (await page.locator("#stage canvas").screenshot()).toString("base64");
  return page.evaluate(async (png) => {
    const image = Object.assign(new Image(), { src: `data:image/png;base64,${png}` });
    await image.decode();
    const { width, height } = image;
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    const pen = canvas.getContext("2d")!;
    pen.drawImage(image, 0, 0);
    const hue = ([r, g, b]: readonly number[]) =>
      Math.atan2(Math.sqrt(3) * (g! - b!), 2 * r! - g! - b!);
    const style = getComputedStyle(document.documentElement);
    const levels = [0, 1, 2, 3].map((level) => {
      const hex = style.getPropertyValue(`--level-${level}`).trim().slice(1);
      return hue([0, 2, 4].map((at) => Number.parseInt(hex.slice(at, at + 2), 16)));
    });
    const found = [0, 0, 0, 0];
    const { data } = pen.getImageData(0, 0, width, height);
    for (let at = 0; at < data.length; at += 4) {
      const rgb = [data[at]!, data[at + 1]!, data[at + 2]!];
      if (Math.max(...rgb) - Math.min(...rgb) < 60) continue;
      const apart = levels.map((level) => 1 - Math.cos(level - hue(rgb)));
      const nearest = apart.indexOf(Math.min(...apart));
      if (apart[nearest]! < 0.03) found[nearest]!++;
    }
    return found;
  }, png);
}
