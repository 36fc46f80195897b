/** Faults around the page: it names them in words, and goes on by itself. */

import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { cpSync, rmSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { Between, cut, slowly } from "./between.ts";
import { blank, browser } from "./harness.ts";
import { picture, settled, sigma, slider, typed, until } from "./look.ts";
import { Serving } from "./serving.ts";

const REACH =
  "/#reaching?stature=1.75&hip_height=0.9&turn=20&target_height=1.1&~playing=no&~time=0.5";

let chromium: Browser;
let serving: Serving;
before(async () => {
  [chromium, serving] = await Promise.all([browser(), Serving.make()]);
});
after(async () => {
  await chromium.close();
  await serving.end();
});

async function on(act: (page: Page) => Promise<void>, path = REACH, at = serving): Promise<void> {
  const page = await blank(chromium, { viewport: { width: 1280, height: 720 } });
  const faults: string[] = [];
  page.on("pageerror", (fault) => faults.push(String(fault)));
  try {
    await page.goto(at.address + path);
    await act(page);
    assert.deepEqual(faults, []);
  } finally {
    await page.close();
  }
}

const fault = (page: Page) => page.locator("#notice .fault");
const remark = (page: Page) => page.locator("#notice .remark");

/** A busy machine may show the drawing before the last for a while. */
const stays = (page: Page, before: Buffer) =>
  until(async () => before.equals(await picture(page)), "the picture is as before");

const BUSY = {
  status: 503,
  contentType: "application/problem+json",
  body: JSON.stringify({
    type: "urn:posefield:problem:overloaded",
    title: "Busy",
    status: 503,
    detail: "1000 requests",
    instance: "0123456789abcdef",
    errors: [],
  }),
};

test("a service that stops is missed, its last picture stays, and its return is noticed", () =>
  on(async (page) => {
    await settled(page);
    const before = await picture(page);
    assert.ok(!(await fault(page).isVisible()));
    await serving.stop();
    await slider(page, "turn").fill("300");
    await fault(page).getByText("The service does not answer").waitFor();
    await stays(page, before);
    await serving.start();
    await fault(page).waitFor({ state: "hidden" });
    await until(async () => !before.equals(await picture(page)), "what was asked is answered");
  }));

test("a page that nobody touches notices too", () =>
  on(async (page) => {
    await settled(page);
    await serving.stop();
    await fault(page).waitFor();
    await serving.start();
    await fault(page).waitFor({ state: "hidden" });
  }));

test("a model that disappears is named, another is shown; one that is replaced is opened anew", () =>
  on(async (page) => {
    await settled(page);
    rmSync(join(serving.models, "reaching.onnx"));
    await remark(page)
      .getByText(/reaching is not on this service.*cmu_walk/)
      .waitFor();
    await page.locator('[data-control="speed"]').waitFor();
    const other = join(serving.models, "cmu_walk.onnx");
    cpSync(other, join(serving.models, "reaching.onnx"));
    await until(
      async () =>
        (await page.getByLabel("Model", { exact: true }).innerText()).includes("reaching"),
      "the model is listed again",
    );
    await page.getByLabel("Model", { exact: true }).selectOption("reaching");
    await until(async () => page.url().includes("#reaching"), "it is shown");
    const models =
      process.env["POSEFIELD_MODELS"] ?? join(import.meta.dirname, "../../../build/models");
    cpSync(join(models, "reaching.onnx"), join(serving.models, "reaching.onnx"));
    await remark(page).getByText("reaching has been replaced on the service").waitFor();
    await page.locator('[data-control="stature"]').waitFor();
  }));

test("a model chosen while nobody answers is shown when somebody does", () =>
  on(async (page) => {
    await settled(page);
    await serving.stop();
    await page.getByLabel("Model", { exact: true }).selectOption("cmu_walk");
    await fault(page).getByText("The service does not answer").waitFor();
    await serving.start();
    await page.locator('[data-control="speed"]').waitFor();
    await fault(page).waitFor({ state: "hidden" });
  }));

test("an answer that breaks off leaves the picture, and is asked for again", () =>
  on(async (page) => {
    await settled(page);
    const before = await picture(page);
    await page.route(/msgpack/, (route) => route.abort("connectionreset"));
    await slider(page, "turn").fill("300");
    await fault(page).getByText("The last picture stays").waitFor();
    await stays(page, before);
    await page.unroute(/msgpack/);
    await fault(page).waitFor({ state: "hidden" });
  }));

test("a stage that the graphics card lost is drawn again", () =>
  on(async (page) => {
    await settled(page);
    const before = await picture(page);
    const lose = await page.locator("#stage canvas").evaluateHandle((it: HTMLCanvasElement) => {
      return it.getContext("webgl2")!.getExtension("WEBGL_lose_context")!;
    });
    await lose.evaluate((it) => it.loseContext());
    await page.waitForTimeout(300);
    await lose.evaluate((it) => it.restoreContext());
    await page.waitForTimeout(300);
    await stays(page, before);
  }));

// These wait more than they compute, and leave the service as it is.
describe("at one service", { concurrency: 2 }, () => {
  test("an answer that comes late does not overwrite a newer one, and none queue up", () =>
    on(async (page) => {
      await settled(page);
      let [asked, open, most] = [0, 0, 0];
      await page.route(/pose.msgpack/, async (route) => {
        asked += 1;
        open += 1;
        most = Math.max(most, open);
        await new Promise((done) => setTimeout(done, asked === 1 ? 900 : 100));
        await route.continue();
        open -= 1;
      });
      await slider(page, "turn").evaluate((range: HTMLInputElement) => {
        for (let at = 1; at <= 24; at++) {
          range.value = String(300 + 40 * at);
          range.dispatchEvent(new Event("input", { bubbles: true }));
        }
      });
      const wanted = await typed(page, "turn").inputValue();
      await until(
        async () =>
          Math.abs(
            Number(new URLSearchParams(page.url().split("?")[1]).get("turn")) - Number(wanted),
          ) < 1,
        "the address has the last",
      );
      assert.equal(most, 1, "never two at once");
      assert.ok(asked <= 3, `${asked} questions for 24 movements`);
      await until(async () => open === 0, "all are answered");
      await page.unroute(/pose.msgpack/);
      const last = await sigma(page);
      await page.waitForTimeout(1200);
      assert.equal(await sigma(page), last);
      await page.reload();
      await settled(page);
      assert.equal(await sigma(page), last, "as if nothing else had ever been asked");
    }));

  test("an answer that makes no sense is said to be that, and the next one heals it", () =>
    on(async (page) => {
      await settled(page);
      await page.route(/msgpack/, (route) => route.fulfill({ status: 200, body: "\x80" }));
      await slider(page, "turn").fill("300");
      await fault(page).waitFor();
      await page.unroute(/msgpack/);
      await fault(page).waitFor({ state: "hidden" });
    }));

  test("a service that is ready and fails all the same is asked ever more seldom", () =>
    on(async (page) => {
      await settled(page);
      let looked = 0;
      page.on("request", (request) => {
        looked += Number(request.url().endsWith("/readyz"));
      });
      await page.route(/msgpack/, (route) => route.abort("connectionreset"));
      await slider(page, "turn").fill("300");
      await fault(page).waitFor();
      await page.waitForTimeout(6000);
      assert.ok(looked > 1 && looked < 7, `${looked} looks in six seconds`);
    }));

  test("a busy service is said to be busy", () =>
    on(async (page) => {
      await settled(page);
      await page.route(/msgpack/, (route) => route.fulfill(BUSY));
      await slider(page, "turn").fill("300");
      await fault(page)
        .getByText(/busy or restarting/)
        .waitFor();
      await page.unroute(/msgpack/);
      await fault(page).waitFor({ state: "hidden" });
    }));

  test("a card that is refused once is asked for again, and no other model is shown", async () => {
    const page = await blank(chromium);
    let refused = 0;
    await page.route(/models\/reaching$/, (route) =>
      refused++ ? route.continue() : route.fulfill(BUSY),
    );
    await page.goto(`${serving.address}/#reaching?turn=33`);
    await fault(page).getByText("busy or restarting").waitFor();
    await page.locator('[data-control="turn"]').waitFor();
    assert.equal(await typed(page, "turn").inputValue(), "33");
    assert.match(page.url(), /#reaching\?.*turn=33/);
    assert.ok(!(await remark(page).isVisible()));
    await page.close();
  });

  test("a name that cannot be is no model", () =>
    on(async (page) => {
      await remark(page).getByText("a/b is not on this service").waitFor();
      await settled(page);
    }, "/#a%2Fb"));

  test("a version that goes is missed like a model that goes", () =>
    on(async (page) => {
      await settled(page);
      const pinned = await page.evaluate(async () => {
        const answer = await (await fetch("/v1/models")).json();
        return answer.models.find(({ name }: { name: string }) => name === "reaching").identity;
      });
      await page.goto(`${serving.address}/#${pinned}`);
      await page.reload();
      await settled(page);
      assert.ok(!(await remark(page).isVisible()));
      await page.route(/v1\/models$/, async (route) => {
        const answer = await (await route.fetch()).json();
        for (const model of answer.models)
          if (model.name === "reaching")
            Object.assign(model, { identity: "reaching@0", versions: [] });
        await route.fulfill({ json: answer });
      });
      await remark(page).getByText(`${pinned} is not on this service`).waitFor();
      await page.locator('[data-control="speed"]').waitFor();
    }));

  test("who takes too long is said to be slow", () =>
    on(async (page) => {
      await settled(page);
      await page.route(/msgpack/, () => {});
      await slider(page, "turn").fill("300");
      await fault(page).getByText("took too long").waitFor();
      await page.unroute(/msgpack/);
      await fault(page).waitFor({ state: "hidden" });
    }));

  test("a clip that comes slowly arrives; one that is cut is asked for again", async () => {
    const between = await Between.make(serving.address);
    try {
      between.clips = slowly(10, 1000);
      const page = await blank(chromium);
      await page.goto(between.address + REACH);
      await page.locator("#stage[data-clip]").waitFor();
      assert.ok(!(await fault(page).isVisible()));
      between.clips = cut;
      await slider(page, "turn").fill("300");
      await fault(page).getByText("The last picture stays").waitFor();
      assert.equal(await page.locator("#stage[data-clip]").count(), 0);
      between.clips = slowly(1, 0);
      await page.locator("#stage[data-clip]").waitFor();
      await fault(page).waitFor({ state: "hidden" });
      await page.close();
    } finally {
      await between.end();
    }
  });

  test("a browser without WebGL is told so", () =>
    on(async (page) => {
      await page.addInitScript(() => {
        HTMLCanvasElement.prototype.getContext = () => null;
      });
      await page.reload();
      await fault(page).getByText("no 3-D graphics").waitFor();
      await page.waitForTimeout(6000);
      assert.match((await fault(page).textContent())!, /no 3-D graphics/);
    }));

  test("a page that may keep nothing opens all the same", () =>
    on(async (page) => {
      await page.addInitScript(() => {
        const refuse = () => {
          throw new DOMException("blocked", "SecurityError");
        };
        Object.defineProperty(window, "sessionStorage", { get: refuse });
      });
      await page.reload();
      await settled(page);
    }));

  test("a version and an address are remarked on side by side", async () => {
    const page = await blank(chromium);
    await page.route("**/livez", (route) => route.fulfill({ json: { contract: "2.2.0" } }));
    await page.goto(`${serving.address}/#reaching?height=2`);
    await remark(page).getByText("another version").waitFor();
    await remark(page).getByText("height: this model has no such control").waitFor();
    await page.close();
  });

  for (const [contract, words] of [
    ["5.0.0", null],
    ["5.7.3", null],
    ["2.2.0", /another version.*2\.2\.0/],
    [undefined, /contract unsaid/],
  ] as const)
    test(`contract ${contract ?? "unsaid"} ${words ? "is remarked on" : "is fine"}`, async () => {
      const page = await blank(chromium);
      await page.route("**/livez", (route) =>
        route.fulfill({ json: { status: "live", contract } }),
      );
      await page.goto(serving.address + REACH);
      if (words) await remark(page).getByText(words).waitFor();
      else {
        await settled(page);
        assert.ok(!(await remark(page).isVisible()));
      }
      await page.close();
    });

  test("a key is asked for, kept in this tab, and used", async () => {
    const secret = `pf_${"a".repeat(43)}`;
    const digest = createHash("sha256").update(secret).digest("hex");
    const locked = await Serving.make({ POSEFIELD_KEYS: `page ${digest} read:*` });
    try {
      await on(
        async (page) => {
          const dialog = page.getByRole("dialog", { name: "A key, please" });
          await dialog.waitFor();
          await page.getByLabel("API key or token").fill("schlüssel");
          await page.keyboard.press("Enter");
          await dialog.getByText("This cannot be a key").waitFor();
          await page.keyboard.press("Escape");
          await page.waitForTimeout(6000);
          assert.ok(!(await dialog.isVisible()), "who closes it is not asked again");
          await fault(page).getByRole("button", { name: "Enter a key" }).click();
          await page.getByLabel("API key or token").fill("wrong");
          await page.keyboard.press("Enter");
          await dialog.waitFor();
          await page.getByLabel("API key or token").fill(secret);
          await page.keyboard.press("Enter");
          await settled(page);
          assert.ok(!(await dialog.isVisible()));
          await page.reload();
          await settled(page);
          assert.equal(await page.evaluate(() => localStorage.getItem("posefield-key")), null);
        },
        REACH,
        locked,
      );
    } finally {
      await locked.end();
    }
  });
});
