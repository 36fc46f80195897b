/** Everybody can use it: axe finds nothing serious, in light and dark, on a desk and on a tablet. */

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { broken } from "./axe.ts";
import { blank, browser, SERVICE } from "./harness.ts";
import { settled, slider, until } from "./look.ts";

const REACH =
  "/#reaching?stature=1.75&hip_height=0.9&turn=20&target_height=1.1&~playing=no&~ghost=yes&~feet=yes";
const SIZES = { desk: { width: 1280, height: 720 }, tablet: { width: 768, height: 1024 } };

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

async function shown(scheme: "light" | "dark", size: keyof typeof SIZES): Promise<Page> {
  const page = await blank(chromium, {
    viewport: SIZES[size],
    colorScheme: scheme,
    hasTouch: size === "tablet",
    bypassCSP: true,
  });
  await page.goto(SERVICE + REACH);
  await settled(page);
  return page;
}

for (const scheme of ["light", "dark"] as const)
  for (const size of ["desk", "tablet"] as const)
    test(`nothing serious, ${scheme}, ${size}`, async () => {
      const page = await shown(scheme, size);
      assert.deepEqual(await broken(page), []);
      await slider(page, "turn").fill("1500");
      await page.locator(".warnings li").first().waitFor();
      assert.deepEqual(await broken(page), []);
      await page.getByRole("button", { name: "Keys" }).click();
      assert.deepEqual(await broken(page), []);
      await page.keyboard.press("Escape");
      for (const [view, section] of [
        ["Compare all", "levels"],
        ["Crowd", "crowd"],
      ] as const) {
        await page.getByRole("button", { name: view, exact: true }).click();
        await page.locator(`section.${section}`).waitFor();
        assert.deepEqual(await broken(page), [], view);
      }
      await page.close();
    });

test("axe would notice a field without a name and text without contrast", async () => {
  const page = await shown("light", "desk");
  await page.evaluate(() => {
    document.querySelector("#side input[type=text]")!.removeAttribute("aria-label");
    (document.querySelector(".sentence") as HTMLElement).style.color = "#ddd";
  });
  assert.match((await broken(page)).join(), /color-contrast.*label|label.*color-contrast/);
  await page.close();
});

/** The parts that Tab comes through until it begins again. */
async function tabbed(page: Page): Promise<ReadonlySet<string>> {
  const reached = new Set<string>();
  for (let press = 0; press < 400; press++) {
    await page.keyboard.press("Tab");
    const [part, again] = await page.evaluate(() => {
      const at = document.activeElement as HTMLElement;
      const again = "tabbed" in at.dataset;
      if (at !== document.body) at.dataset["tabbed"] = "";
      return [
        at.closest<HTMLElement>("[data-part]")?.dataset["part"] ??
          at.parentElement?.id ??
          at.tagName,
        again,
      ];
    });
    if (again) return reached;
    reached.add(part);
  }
  throw new Error("Tab does not come around");
}

test("nothing lies beside the screen, and everything is reached by Tab", async () => {
  for (const size of ["desk", "tablet"] as const) {
    const page = await shown("light", size);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(wide <= 0, `${size}: ${wide} px too wide`);
    const reached = await tabbed(page);
    for (const part of ["options", "controls", "trust", "target", "map", "files", "time", "bar"])
      assert.ok(reached.has(part), `${part} of ${[...reached]}`);
    await page.close();
  }
});

test("targets are of 32 pixels, and of 44 for fingers; the section on top is the marked one", async () => {
  for (const [least, width, hasTouch] of [
    [32, 1440, false],
    [44, 390, true],
  ] as const) {
    const page = await blank(chromium, { viewport: { width, height: 844 }, hasTouch });
    for (const view of ["one", "crowd", "performance"]) {
      await page.goto(`${SERVICE}/#cmu_walk?~playing=no&~view=${view}`);
      await page.locator("#stage[data-clip]").waitFor();
      const small = await page.evaluate((least) => {
        const all = [...document.querySelectorAll("button, select, input, a, summary")];
        const targets = all
          .filter((it) => it.checkVisibility())
          .map((it) => it.closest(".check") ?? it);
        const sizes = (it: Element) =>
          [it.getBoundingClientRect()].flatMap((it) => [it.width, it.height]);
        return targets
          .filter((it) => Math.min(...sizes(it)) < least - 0.5)
          .map((it) => it.outerHTML);
      }, least);
      assert.deepEqual(small, [], `${view}, ${width}`);
    }
    await page.getByRole("button", { name: "Single" }).click();
    const marked = () => page.locator(".jumps [aria-current=true]").allTextContents();
    assert.deepEqual(await marked(), ["Controls"]);
    for (const name of ["Detail", "Download", "Map"]) {
      await page.getByRole("button", { name, exact: true }).click();
      await until(async () => (await marked()).join() === name, `${name} is marked`);
    }
    await page.getByRole("button", { name: "Crowd" }).click();
    await until(async () => (await marked()).join() === "Controls", "a view begins at its top");
    await page.close();
  }
});

test("who wants stillness gets it, and may play all the same", async () => {
  const page = await blank(chromium, { reducedMotion: "reduce" });
  await page.goto(`${SERVICE}/#reaching`);
  await settled(page);
  const play = page.getByRole("button", { name: "Play (space)" });
  await play.click();
  await page.getByRole("button", { name: "Pause (space)" }).waitFor();
  await page.close();
});

test("light and dark are as the system has them until one says otherwise", async () => {
  const page = await blank(chromium, { colorScheme: "dark" });
  await page.goto(`${SERVICE}/#reaching`);
  const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const dark = await paper();
  await page.getByRole("button", { name: "Light or dark (T)" }).click();
  const light = await paper();
  assert.notEqual(light, dark);
  await page.reload();
  assert.equal(await paper(), light);
  await page.close();
});
