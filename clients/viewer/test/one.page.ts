/** One body: everything that one can press, drag and type, against a running service. */

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, opened } from "./harness.ts";
import { picture, settled, sigma, slider, time, typed, until } from "./look.ts";

const REACH =
  "/#reaching?stature=1.75&hip_height=0.9&turn=20&target_height=1.1&~playing=no&~time=0.5";
const WALK = "/#cmu_walk?speed=1.2&turn=0&stride_length=1.3&~playing=no&~time=0.3";

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

/** Seconds that the transport goes on in one of the page's, looked at over so many of them. */
function rate(page: Page, seconds: number): Promise<number> {
  return page.evaluate(async (seconds) => {
    const now = () => Number.parseFloat(document.querySelector(".time")!.textContent!);
    while (now() === 0) await new Promise(requestAnimationFrame);
    const frame = () => new Promise<number>(requestAnimationFrame);
    const from = now();
    let [last, passed] = [await frame(), 0];
    while (passed < seconds) {
      const next = await frame();
      // Frames that take longer are no more to the page either, so that nothing jumps.
      passed += Math.min(0.1, (next - last) / 1000);
      last = next;
    }
    return (now() - from) / passed;
  }, seconds);
}

/** A page in which nothing may go wrong unnoticed. */
async function on(
  path: string,
  act: (page: Page, faults: string[]) => Promise<void>,
): Promise<void> {
  const { page, faults } = await opened(chromium, path);
  try {
    await settled(page);
    await act(page, faults);
    assert.deepEqual(faults, []);
  } finally {
    await page.close();
  }
}

test("it opens on a body that moves", () =>
  on("/", async (page) => {
    assert.match(await page.title(), /posefield/);
    const first = await time(page);
    await until(async () => (await time(page)) !== first, "time goes on");
    assert.ok(
      await page
        .locator("#notice p")
        .evaluateAll((all) => all.every((p) => (p as HTMLElement).hidden)),
    );
  }));

test("space plays and pauses, arrows step, the scrubber seeks", () =>
  on(REACH, async (page) => {
    assert.equal(await time(page), 0.5);
    const rest = await picture(page);
    await page.keyboard.press("ArrowRight");
    assert.ok(Math.abs((await time(page)) - 0.52) < 0.011);
    assert.ok(!rest.equals(await picture(page)));
    await page.keyboard.press("ArrowLeft");
    assert.ok(rest.equals(await picture(page)), "the same frame is the same picture");
    await page.keyboard.press(" ");
    await until(async () => (await time(page)) > 0.6, "it plays");
    await page.keyboard.press(" ");
    const stopped = await time(page);
    await page.waitForTimeout(300);
    assert.equal(await time(page), stopped);
    await page.getByLabel("Time", { exact: true }).fill("1");
    assert.equal(await time(page), 1);
  }));

test("without a loop it stops at its end; slower is slower", () =>
  on(REACH, async (page) => {
    await page.getByRole("button", { name: "Loop" }).click();
    await page.getByLabel("Speed").fill("2");
    await page.getByRole("button", { name: "Play (space)" }).click();
    await until(
      async () =>
        /^(.*) s \/ \1 s$/.test((await page.locator("[data-part=time] .time").textContent())!),
      "it ends",
    );
    await page.getByRole("button", { name: "Play (space)" }).waitFor();
    await until(async () => page.url().includes("~loop=no"), "the address says so");
  }));

test("at half the speed time goes half as fast", () =>
  on(REACH, async (page) => {
    await page.getByRole("button", { name: "Loop" }).click();
    const rates: number[] = [];
    for (const speed of ["0.5", "1"]) {
      await page.getByLabel("Speed").fill(speed);
      await page.getByLabel("Time", { exact: true }).fill("0");
      await page.getByRole("button", { name: "Play (space)" }).click();
      rates.push(await rate(page, 0.5));
      await page.keyboard.press("Home");
    }
    const [half, whole] = rates;
    assert.ok(half! / whole! > 0.35 && half! / whole! < 0.7, `${rates} seconds a second`);
  }));

test("a loop begins again at its end, and frames step around it", () =>
  on(REACH, async (page) => {
    await page.keyboard.press("End");
    const end = await time(page);
    assert.ok(end > 0.6);
    await page.keyboard.press("ArrowRight");
    assert.equal(await time(page), 0);
    await page.keyboard.press("ArrowLeft");
    assert.equal(await time(page), end);
    await page.getByLabel("Time", { exact: true }).fill(String(end - 0.2));
    await page.keyboard.press(" ");
    await until(async () => (await time(page)) < end - 0.3, "it begins again");
    await page.getByRole("button", { name: "Pause (space)" }).waitFor();
  }));

test("each example is a line beside its slider", () =>
  on(REACH, async (page) => {
    const { controls, examples } = await page.evaluate(async () =>
      (await fetch("/v1/models/reaching")).json(),
    );
    for (const [column, { name, minimum, maximum }] of controls.entries()) {
      const [from, width, path] = await page
        .locator(`[data-control="${name}"] .ticks`)
        .evaluate((ticks) => {
          const sampled = ticks.querySelector(".sampled")!;
          const of = (key: string) => Number(sampled.getAttribute(key));
          return [of("x"), of("width"), ticks.querySelector("path")!.getAttribute("d")!] as const;
        });
      const marks = [...path.matchAll(/M([\d.]+) /g)].map(([, x]) => Number(x));
      const places = examples.map(
        (row: number[]) => from + (width * (row[column]! - minimum)) / (maximum - minimum),
      );
      const near = (x: number, all: number[]) => all.some((each) => Math.abs(each - x) < 0.3);
      assert.ok(marks.length > 1 && new Set(marks).size === marks.length, name);
      assert.deepEqual(
        places.filter((x: number) => !near(x, marks)),
        [],
        name,
      );
      assert.deepEqual(
        marks.filter((x) => !near(x, places)),
        [],
        name,
      );
    }
  }));

test("all controls are reset at once", () =>
  on(REACH, async (page) => {
    for (const name of ["turn", "target_height"]) await slider(page, name).fill("1200");
    await page.getByRole("button", { name: "Reset all" }).click();
    const reset = page.locator(".control button:disabled");
    assert.equal(await reset.count(), await page.locator(".control").count());
    const { controls } = await page.evaluate(async () =>
      (await fetch("/v1/models/reaching")).json(),
    );
    for (const { name, default: value, minimum, maximum } of controls) {
      const off = Number(await typed(page, name).inputValue()) - value;
      assert.ok(Math.abs(off) < 0.01 * (maximum - minimum), name);
    }
  }));

test("a slider moves the body, sigma and the address", () =>
  on(REACH, async (page) => {
    const [rest, trusted] = [await picture(page), await sigma(page)];
    await slider(page, "target_height").fill("1300");
    await until(async () => (await sigma(page)) !== trusted, "sigma is another");
    assert.ok(!rest.equals(await picture(page)));
    await until(async () => !page.url().includes("target_height=1.1&"), "the address follows");
    const { controls } = await page.evaluate(async () =>
      (await fetch("/v1/models/reaching")).json(),
    );
    const usual = controls.find(({ name }: { name: string }) => name === "target_height").default;
    await page.keyboard.press("r");
    const shown = async () => Number(await typed(page, "target_height").inputValue());
    await until(async () => Math.abs((await shown()) - usual) < 0.01, "R resets");
  }));

test("controls that are not set follow those that are, by the same requests", () =>
  on("/#cmu_walk?~playing=no&~time=0.3", async (page) => {
    const asked: string[] = [];
    page.on("request", (request) => {
      const [, kind] = /\/(pose|clip)\./.exec(request.url()) ?? [];
      if (kind && request.method() === "POST")
        asked.push(`${kind} ${JSON.stringify(request.postDataJSON().controls)}`);
    });
    const marks = async () => page.locator(".control .mark").allTextContents();
    assert.deepEqual(await marks(), ["inferred", "inferred", "inferred"]);
    await typed(page, "speed").fill("1.75");
    await typed(page, "speed").press("Enter");
    await until(async () => page.url().includes("stride_length=~1.5"), "the address follows");
    await page.locator("#stage[data-clip]").waitFor();
    assert.deepEqual(asked, ['pose {"speed":1.75}', 'clip {"speed":1.75}']);
    assert.deepEqual(await marks(), ["", "inferred", "inferred"]);
    assert.ok(Number(await typed(page, "stride_length").inputValue()) > 1.5);
    assert.equal(await page.locator(".warnings li").count(), 0);
    await page.getByText("Captured near here", { exact: true }).waitFor();
    const text = await page.locator(".files pre").innerText();
    assert.match(text, /speed=1.75&turn=.*&stride_length=1.5.*exact=speed/);
    // The file of the text is the motion of the stage.
    const link = /'(http[^']*)'/.exec(text)![1]!.replace("clip.usdc", "clip.json");
    const [full, shown] = await page.evaluate(async (link) => {
      const open = link.replace(/&(turn|stride_length)=[^&]*/g, "").replace(/&exact=speed/, "");
      const ask = async (url: string) => (await (await fetch(url)).json()).rotations;
      return [await ask(link), await ask(open)];
    }, link);
    assert.deepEqual(full, shown);
    await page.reload();
    await until(async () => (await marks()).join() === ",inferred,inferred", "links keep it");
    await slider(page, "speed").press("ArrowLeft");
    await until(async () => /speed=1\.7[0-3]/.test(page.url()), "a key moves visibly");
    await page.getByRole("button", { name: "Reset Speed" }).click();
    await until(async () => (await marks()).join() === "inferred,inferred,inferred", "reset");
  }));

test("numbers are typed, and what is none is refused in words", () =>
  on(REACH, async (page) => {
    const field = typed(page, "target_height");
    await field.fill("1,5");
    await field.press("Enter");
    await page.getByText("1,5 is not a number here: write 1.5.").waitFor();
    assert.equal(await field.getAttribute("aria-invalid"), "true");
    assert.match(page.url(), /target_height=1\.1&/);
    await field.fill("1.5");
    await field.press("Enter");
    assert.equal(await field.getAttribute("aria-invalid"), "false");
    await until(async () => page.url().includes("target_height=1.5"), "the address follows");
  }));

test("outside of what was sampled is marked, and inside is not", () =>
  on(REACH, async (page) => {
    const [control, warnings] = [
      page.locator('[data-control="turn"]'),
      page.locator(".warnings li"),
    ];
    assert.equal(await control.getAttribute("data-outside"), null);
    assert.equal(await warnings.count(), 0);
    await slider(page, "turn").fill("1500");
    await warnings.first().waitFor();
    assert.match((await warnings.first().textContent())!, /turn/);
    assert.notEqual(await control.getAttribute("data-outside"), null);
    assert.match((await slider(page, "turn").getAttribute("aria-valuetext"))!, /outside/);
    await page.getByText("That is a guess").first().waitFor();
    assert.equal(await page.locator("[data-band]").textContent(), "a guess");
    // A quarter of the range outside a value acts as it is; beyond, the slider says what is given.
    const [field, given] = [control.getByRole("textbox"), control.locator("[data-given]")];
    assert.equal(await given.textContent(), "");
    await field.fill("900");
    await field.press("Enter");
    await given.getByText(/^Given 1\d\d deg: below what was asked\.$/).waitFor();
    await control.getByRole("button", { name: "Reset Turn" }).click();
    await until(async () => (await warnings.count()) === 0, "the warning goes");
  }));

test("whether anything like it was captured has a mark beside sigma, and who moves another", () =>
  on(WALK, async (page) => {
    const [support, who] = ["support", "performer"].map((of) => page.locator(`[data-mark=${of}]`));
    await support!.getByText("Captured near here").waitFor();
    await who!.getByText("Moves as an unseen performer").waitFor();
    const sign = () => support!.locator("path").getAttribute("d");
    const before = await sign();
    // Within the range of each control, but no captured clip is near.
    await typed(page, "speed").fill("1.7");
    await typed(page, "speed").press("Enter");
    await typed(page, "stride_length").fill("1");
    await typed(page, "stride_length").press("Enter");
    await support!.getByText("Nothing like it was captured").waitFor();
    assert.notEqual(await sign(), before);
    await until(
      async () =>
        /Nothing like it/.test(
          (await page.locator("[data-part=trust] [aria-live]").textContent())!,
        ),
      "it is said aloud",
    );
    await page.getByLabel("Performer").selectOption("cmu_35");
    await who!.getByText("cmu_35 was captured").waitFor();
    await page.getByRole("button", { name: "Reset all controls (R)" }).click();
    await support!.getByText("Captured near here").waitFor();
  }));

test("a body that stays in place has the same marks", () =>
  on(`${WALK}&~root=in_place`, async (page) => {
    await page.locator("[data-mark=support]", { hasText: "Captured near here" }).waitFor();
    await page.locator("[data-mark=performer]", { hasText: "unseen performer" }).waitFor();
  }));

test("a control with few sampled values snaps to them", () =>
  on(REACH, async (page) => {
    await slider(page, "stature").fill("700");
    assert.equal(await typed(page, "stature").inputValue(), "1.750");
    await slider(page, "stature").fill("1100");
    assert.equal(await typed(page, "stature").inputValue(), "1.880");
    await slider(page, "hip_height").fill("700");
    assert.notEqual(await typed(page, "hip_height").inputValue(), "0.900");
  }));

test("a clip that has become shorter than the time shown is asked for as one that has", () =>
  on(
    "/#reaching?stature=1.75&hip_height=0.7&turn=50&target_height=1.7&~playing=no&~time=1.4",
    async (page) => {
      await typed(page, "target_height").fill("0.75");
      await typed(page, "target_height").press("Enter");
      await until(async () => (await time(page)) < 1.2, "the transport goes to the clip's end");
    },
  ));

test("a captured clip near by is named, and a click goes there", () =>
  on(REACH, async (page) => {
    const before = await sigma(page);
    await page.locator(".nearest button").first().click();
    await until(async () => (await sigma(page)) < before, "it is surer there");
    await until(
      async () => /distance 0\.00/.test((await page.locator(".nearest li").first().textContent())!),
      "it is there",
    );
  }));

test("performers are chosen by name", () =>
  on(WALK, async (page) => {
    const before = await sigma(page);
    await page.getByLabel("Performer").selectOption("cmu_35");
    await until(async () => (await sigma(page)) < before, "a known performer is surer");
    await until(async () => page.url().includes("~performer=cmu_35"), "the address follows");
  }));

test("sticks, ghost, contacts and level change the picture", () =>
  on(WALK, async (page) => {
    const seen = [await picture(page)];
    for (const [name, shown] of [
      ["Sticks", "#stage[data-clip]"],
      ["Ghost of the nearest example", "[data-ghost]:not(:empty)"],
    ] as const) {
      await page.getByRole("button", { name }).click();
      await page.locator(shown).waitFor();
      seen.push(await picture(page));
    }
    await page.getByLabel("Level", { exact: true }).selectOption("3");
    seen.push(await picture(page));
    seen.forEach((one, i) => {
      seen.slice(0, i).forEach((other) => {
        assert.ok(!one.equals(other));
      });
    });
    assert.match(
      (await page.locator("[data-ghost]").textContent())!,
      /the model at the controls of .*nearest captured clip/,
    );
    const stage = () => page.locator("#stage canvas").screenshot();
    const without = await stage();
    await page.getByRole("button", { name: "Contacts and skate of the feet" }).click();
    await until(async () => !(await stage()).equals(without), "contacts are drawn");
    assert.match((await page.locator("[data-skate]").textContent())!, /^\d+\.\d cm\/s$/);
  }));

test("root motion carries a walker on, and in place it stays", () =>
  on(WALK.replace("~playing=no", "~feet=yes"), async (page) => {
    // The camera goes along, and the ground with it: it is another each time the body comes by.
    const home = async () => {
      await page.keyboard.press("Home");
      return picture(page);
    };
    const begun = await home();
    await page.keyboard.press(" ");
    await page.waitForTimeout(2500);
    const carried = await home();
    assert.ok(!begun.equals(carried), "it has travelled");
    await page.getByRole("button", { name: "Root motion" }).click();
    await page.getByText("In place, every foot slides").waitFor();
    await until(async () => page.url().includes("~root=in_place"), "the address follows");
    await page.keyboard.press("f");
    const lap = async () => {
      await page.keyboard.press(" ");
      await page.waitForTimeout(2500);
    };
    // Within its leash the camera goes along here too, but once.
    await lap();
    const still = await home();
    await lap();
    assert.ok(still.equals(await home()), "it has stayed");
  }));

test("a point that is typed is met, and the controls follow", () =>
  on(REACH, async (page) => {
    const point = page.locator('[data-part="target"]');
    const y = point.locator('[data-axis="y"]');
    await y.fill(String(Number(await y.inputValue()) + 0.25));
    await y.press("Enter");
    const miss = async () => Number.parseFloat((await point.locator("[data-miss]").textContent())!);
    await until(async () => !page.url().includes("target_height=1.1&"), "controls follow");
    await until(async () => (await miss()) < 0.2, "it is reached");
    assert.equal(await typed(page, "stature").inputValue(), "1.750");
    await y.fill("9");
    await y.press("Enter");
    await until(async () => (await miss()) > 100, "the ceiling is not");
  }));

test("the handle is dragged, and the controls follow", () =>
  on(REACH, async (page) => {
    const stage = (await page.locator("#stage").boundingBox())!;
    const at = (await page.locator('[data-part="target"]').getAttribute("data-handle"))!.split(" ");
    const [x, y] = [stage.x + Number(at[0]), stage.y + Number(at[1])];
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x, y - 30, { steps: 6 });
    await page.mouse.up();
    await until(async () => !page.url().includes("target_height=1.1&"), "controls follow");
  }));

test("back, forward and reload", () =>
  on(REACH, async (page) => {
    await slider(page, "turn").fill("400");
    await until(async () => !page.url().includes("turn=20&"), "the address follows");
    const there = page.url();
    await page.goBack();
    await until(async () => (await typed(page, "turn").inputValue()) === "20", "back is back");
    await page.goForward();
    await until(
      async () => (await typed(page, "turn").inputValue()) !== "20",
      "forward is forward",
    );
    assert.equal(page.url(), there);
    const [turn, trusted] = [await typed(page, "turn").inputValue(), await sigma(page)];
    await page.reload();
    await settled(page);
    assert.deepEqual([await typed(page, "turn").inputValue(), await sigma(page)], [turn, trusted]);
    assert.equal(await time(page), 0.5);
    await page.getByLabel("Model", { exact: true }).selectOption("cmu_walk");
    await page.locator('[data-control="speed"]').waitFor();
    await until(async () => page.url().includes("#cmu_walk"), "the address follows");
    await page.goBack();
    await page.locator('[data-control="stature"]').waitFor();
  }));

test("entries of the address that make no sense are named", () =>
  on(`${REACH}&~level=9&height=2`, async (page) => {
    const notice = page.locator("#notice");
    await notice
      .getByText(/~level: “9”, expected 0 to 3 · height: this model has no such control/)
      .waitFor();
    await notice.getByRole("button", { name: "Close this notice" }).click();
    assert.ok(!(await notice.locator(".remark").isVisible()));
  }));

test("an unknown model is said to be unknown, and another is shown", () =>
  on("/#nobody", async (page, faults) => {
    await page.getByText(/nobody is not on this service.*showing cmu_walk/).waitFor();
    await page.locator('[data-control="speed"]').waitFor();
    assert.match(faults.splice(0).join(), /^Failed to load resource.*404/);
  }));

test("keys are listed, and close with Escape", () =>
  on(REACH, async (page) => {
    const help = page.getByRole("dialog", { name: "Keys" });
    await page.getByRole("button", { name: "Keys" }).click();
    await help.getByText("play or pause").waitFor();
    await page.keyboard.press("Escape");
    assert.ok(!(await help.isVisible()));
  }));
