/** Takes, their fan, and feet that stand: what is drawn, linked and downloaded is what was chosen. */

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { Client, type ClipQuestion } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { browser, opened, SERVICE } from "./harness.ts";
import { picture, settled, slider, until } from "./look.ts";

const WALK = "/#cmu_walk?speed=1.2&turn=0&stride_length=1.3&~playing=no&~time=0.3";
const REACH = "/#reaching?~playing=no&~time=0.5";
const client = new Client(SERVICE);

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

type Asked = Partial<ClipQuestion>;

/** A page in which nothing may go wrong unnoticed, and the clips that it asks for. */
async function on(path: string, act: (page: Page, asked: Asked[]) => Promise<void>): Promise<void> {
  const { page, faults } = await opened(chromium, path);
  try {
    await settled(page);
    const asked: Asked[] = [];
    page.on("request", (request) => {
      if (/\/clip(\.|$)/.test(new URL(request.url()).pathname)) asked.push(request.postDataJSON());
    });
    await act(page, asked);
    assert.deepEqual(faults, []);
  } finally {
    await page.close();
  }
}

const taken = (page: Page, words: string) =>
  page.locator("[data-taken]", { hasText: new RegExp(`^${words}$`) }).waitFor();
const feet = (page: Page, words: RegExp) =>
  page.locator("[data-feet]", { hasText: words }).waitFor();
const link = async (page: Page) => {
  await page.locator(".files").getByRole("button", { name: "Link", exact: true }).click();
  return new URL(await page.locator(".files pre").innerText()).searchParams;
};

test("the next take is another motion, and the prediction comes back as it was", () =>
  on(WALK, async (page, asked) => {
    await taken(page, "the prediction");
    const shots = [await picture(page)];
    for (const take of [1, 2]) {
      await page.getByRole("button", { name: "Next take" }).click();
      await taken(page, `take ${take}`);
      assert.equal(asked.at(-1)!.take, take);
      shots.push(await picture(page));
    }
    assert.equal(new Set(shots.map((shot) => shot.toString("base64"))).size, 3);
    await page.getByRole("button", { name: "Prediction", exact: false }).click();
    await taken(page, "the prediction");
    assert.ok(!("take" in asked.at(-1)!) && !("variety" in asked.at(-1)!));
  }));

test("take, variety and detail are in the address and in what is downloaded, and come back", () =>
  on(WALK, async (page) => {
    await page.getByLabel("Seed", { exact: true }).fill("41");
    await page.getByLabel("Seed", { exact: true }).press("Tab");
    await taken(page, "take 41");
    await page.keyboard.press("n");
    await taken(page, "take 42");
    await page.getByRole("slider", { name: "Variety" }).fill("0.4");
    await page.getByLabel(/^Detail: sampled/).check();
    await until(
      async () => /~take=42&~variety=0\.4&~detail=yes/.test(page.url()),
      "the address says so",
    );
    const said = await link(page);
    assert.deepEqual(
      ["take", "variety", "detail", "feet"].map((key) => said.get(key)),
      ["42", "0.4", "true", null],
    );
    await on(new URL(page.url()).hash.replace("#", "/#"), async (other) => {
      await taken(other, "take 42");
      assert.equal(await other.getByLabel("Seed", { exact: true }).inputValue(), "42");
      assert.deepEqual([...(await link(other))], [...said]);
    });
    await page.keyboard.press("p");
    await until(async () => !page.url().includes("~take"), "the address has no take");
    assert.match(page.url(), /~variety=0\.4&~detail=yes/);
  }));

test("a take stays while a control is on the move, and other levels have it too", () =>
  on(`${WALK}&~take=7`, async (page, asked) => {
    await taken(page, "take 7");
    const pose = page.waitForRequest(/\/pose(\.|$)/);
    await slider(page, "speed").fill("900");
    assert.equal((await pose).postDataJSON().take, 7);
    await taken(page, "take 7");
    await page.locator("#stage[data-clip]").waitFor();
    asked.length = 0;
    await page.getByRole("button", { name: "Compare all" }).click();
    await page.locator(".levels-now", { hasText: "px" }).first().waitFor();
    assert.deepEqual(
      asked.map(({ level, take }) => [level, take]),
      [0, 1, 2, 3].map((level) => [level, 7]),
    );
  }));

test("a seed that is none is not taken", () =>
  on(REACH, async (page) => {
    for (const wrong of ["-1", "1.5", "1000000000"]) {
      await page.getByLabel("Seed", { exact: true }).fill(wrong);
      await page.getByLabel("Seed", { exact: true }).press("Tab");
      assert.equal(await page.getByLabel("Seed", { exact: true }).inputValue(), "0");
    }
    assert.ok(!page.url().includes("~take"));
    assert.ok(await page.getByLabel(/^Detail: sampled/).isHidden(), "it has none to sample");
  }));

test("a fan shows five other takes, and none when it is shut", () =>
  on(WALK, async (page, asked) => {
    const alone = await picture(page);
    await page.getByRole("button", { name: "Fan of other takes (V)" }).click();
    await page.getByText("Fan: takes 1, 2, 3, 4, 5 of the same question").waitFor();
    assert.deepEqual(asked.map(({ take }) => take).sort(), [1, 2, 3, 4, 5]);
    assert.ok(!alone.equals(await picture(page)));
    await page.keyboard.press("n");
    await page.getByText("Fan: takes 2, 3, 4, 5, 6 of").waitFor();
    await page.keyboard.press("p");
    await page.getByText("Fan: takes 1, 2, 3, 4, 5 of").waitFor();
    await page.keyboard.press("v");
    assert.ok(alone.equals(await picture(page)));
  }));

test("feet stand or are as predicted, and trust says what was done", () =>
  on(WALK, async (page, asked) => {
    const controls = { speed: 1.2, turn: 0, stride_length: 1.3 };
    const { trust } = await client.clip("cmu_walk", { controls, fps: 60, loop: true });
    const found = trust.feet!;
    await feet(page, /^Feet stand: /);
    const said = (await page.locator("[data-feet]").textContent())!;
    const slides = (speed: number) => `${(100 * speed).toFixed(1)} cm/s`;
    for (const words of [
      `${found.stances.length} stances, ${found.swings} swings`,
      `skate ${slides(found.skate_before)} before, ${slides(found.skate)} now`,
      found.lowered
        ? `pelvis lowered by up to ${(100 * found.lowered).toFixed(1)} cm`
        : "pelvis not lowered",
    ])
      assert.ok(said.includes(words), said);
    const standing = await picture(page);
    const stand = page.getByRole("button", { name: "Feet stand" });
    assert.equal(await stand.getAttribute("aria-pressed"), "true");
    await stand.click();
    await feet(page, /^Feet as predicted\.$/);
    assert.equal(asked.at(-1)!.feet, "as_predicted");
    assert.equal((await link(page)).get("feet"), "as_predicted");
    await until(async () => page.url().includes("~stands=no"), "the address says so");
    assert.ok(!standing.equals(await picture(page)));
    await page.keyboard.press("s");
    await feet(page, /^Feet stand: /);
    assert.ok(standing.equals(await picture(page)));
    await page.getByRole("button", { name: "Crowd" }).click();
    await page.locator("[data-feet]").waitFor({ state: "hidden" });
  }));

test("where feet cannot stand there is no switch, and the reason is said", () =>
  on(REACH, async (page) => {
    await feet(page, /^Feet as predicted: this model names no feet\.$/);
    assert.ok(await page.getByRole("button", { name: "Feet stand" }).isHidden());
    await page.keyboard.press("s");
    await page.waitForTimeout(500);
    assert.ok(!page.url().includes("~stands"));
  }));
