/** The page at `/docs` in a browser: drawn, searched, driven by keys, and asked to try each operation. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { browser, SERVICE } from "../../viewer/test/harness.ts";
import { COMMAND } from "../../viewer/test/static.ts";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

/** The page, drawn; `faults` gathers errors, broken policies and requests to other places. */
async function shown(
  scheme: "light" | "dark" = "light",
  bypassCSP = false,
): Promise<{ page: Page; faults: string[] }> {
  const size = { width: 1280, height: 900 };
  const page = await chromium.newPage({ viewport: size, colorScheme: scheme, bypassCSP });
  const faults: string[] = [];
  page.on("pageerror", (fault) => faults.push(String(fault)));
  page.on("console", (line) => {
    if (line.type() === "error") faults.push(line.text());
  });
  page.on("request", (request) => {
    if (!/^(data|blob):/.test(request.url()) && !request.url().startsWith(SERVICE))
      faults.push(request.url());
  });
  await page.goto(`${SERVICE}/docs`);
  await page.locator(".opblock").first().waitFor();
  return { page, faults };
}

function operations(page: Page): Promise<number> {
  return page.locator(".opblock").count();
}

async function contract(): Promise<{ paths: Record<string, object> }> {
  return (await (await fetch(`${SERVICE}/openapi.json`)).json()) as {
    paths: Record<string, object>;
  };
}

for (const [scheme, ground] of [
  ["light", 255],
  ["dark", 28],
] as const)
  test(`it draws all operations and loads nothing from elsewhere, ${scheme}`, async () => {
    const { page, faults } = await shown(scheme);
    const methods = ["get", "post"];
    const items = Object.values((await contract()).paths);
    const agreed = items.flatMap((item) => methods.filter((method) => method in item));
    assert.equal(await operations(page), agreed.length);
    const colour = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const drawn = colour === "rgba(0, 0, 0, 0)" ? 255 : Number(colour.match(/\d+/)![0]);
    assert.equal(drawn, ground);
    assert.deepEqual(faults, []);
    await page.close();
  });

test("it follows the scheme when that changes", async () => {
  const { page } = await shown("light");
  const dark = () => page.evaluate(() => document.documentElement.classList.contains("dark-mode"));
  assert.equal(await dark(), false);
  await page.emulateMedia({ colorScheme: "dark" });
  await page.waitForFunction(() => document.documentElement.classList.contains("dark-mode"));
  await page.close();
});

// Each kind of question, by query and by body, and each kind of answer.
const TRIED = [
  "models-getModel",
  "poses-getPoseInFormat",
  "poses-queryPoseInFormat",
  "clips-getClipInFormat",
  "clips-queryClipInFormat",
  "clips-queryClipsInFormat",
  "crowds-queryCrowdInFormat",
  "trust-getWhy",
  "trust-getSigmaInFormat",
  "trust-querySigmaInFormat",
  "service-getMetrics",
];

for (const id of TRIED)
  test(`${id} can be tried as it stands, with a model that is loaded`, async () => {
    const { page, faults } = await shown();
    const block = page.locator(`#operations-${id}`);
    await block.locator(".opblock-summary-control").click();
    await block.locator("button.execute").click();
    const status = block.locator(".live-responses-table tbody .response-col_status").first();
    await status.waitFor();
    assert.match(await status.innerText(), /^200/);
    assert.deepEqual(faults, []);
    await page.close();
  });

test("a question that is wrong shows the problem", async () => {
  const { page } = await shown();
  const block = page.locator("#operations-models-getModel");
  await block.locator(".opblock-summary-control").click();
  await block.getByPlaceholder("model").fill("nobody");
  await block.locator("button.execute").click();
  await block
    .locator(".live-responses-table")
    .getByText("urn:posefield:problem:unknown-model")
    .waitFor();
  await page.close();
});

test("the search finds operations by words of their path, name and description", async () => {
  const { page } = await shown();
  const all = await operations(page);
  const search = page.getByRole("textbox", { name: "Search operations" });
  await search.fill("glb clip");
  await page.waitForFunction(() => document.querySelectorAll(".opblock").length === 2);
  assert.match(await page.locator(".opblock-summary-path").first().innerText(), /clip\.\{format\}/);
  await search.fill("no such operation");
  await page.waitForFunction(() => document.querySelectorAll(".opblock").length === 0);
  await search.fill("");
  await page.waitForFunction((n) => document.querySelectorAll(".opblock").length === n, all);
  await page.close();
});

test("the keyboard opens an operation and tries it", async () => {
  const { page } = await shown();
  const block = page.locator("#operations-models-listModels");
  await page.getByRole("textbox", { name: "Search operations" }).focus();
  const focused = () => page.evaluate(() => document.activeElement?.closest(".opblock")?.id ?? "");
  for (let step = 0; step < 12 && (await focused()) !== "operations-models-listModels"; step++)
    await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  // One step that waits for the button, focuses it and presses: an operation is drawn again once
  // its parts are resolved, and a button that was focused before that is another one.
  await block.locator("button.execute").press("Enter");
  await block.locator(".live-responses-table").waitFor();
  await page.close();
});

// Rules that Swagger UI itself breaks: its summaries are buttons with a link in them, and its examples scroll.
const KNOWN = ["nested-interactive", "scrollable-region-focusable"];

for (const scheme of ["light", "dark"] as const)
  test(`axe finds nothing serious but what is known, ${scheme}`, async () => {
    const { page } = await shown(scheme, true);
    await page.locator("#operations-poses-getPoseInFormat .opblock-summary-control").click();
    await page.locator("#operations-poses-queryPoseInFormat .opblock-summary-control").click();
    await page.locator("#operations-poses-queryPoseInFormat button.execute").waitFor();
    const serious = () =>
      page.evaluate(async () => {
        type Violation = { id: string; impact: string; nodes: { html: string }[] };
        const { axe } = window as unknown as {
          axe: { run(): Promise<{ violations: Violation[] }> };
        };
        const { violations } = await axe.run();
        return violations
          .filter(({ impact }) => impact === "serious" || impact === "critical")
          .map(({ id, nodes }) => [id, nodes[0]!.html] as const);
      });
    await page.evaluate(AXE);
    const unknown = async () => (await serious()).filter(([id]) => !KNOWN.includes(id));
    assert.deepEqual(await unknown(), []);
    // A field that loses its name is noticed.
    await page.locator("#servers").evaluate((field) => {
      field.removeAttribute("aria-label");
    });
    assert.deepEqual(
      (await unknown()).map(([id]) => id),
      ["select-name"],
    );
    await page.close();
  });

// The command that runs each language's code.
const RUN: Readonly<Record<string, readonly string[]>> = {
  curl: ["sh", "-c"],
  Python: [join(dirname(COMMAND), "python"), "-c"],
  JavaScript: [process.execPath, "--input-type=module", "-e"],
};

test("the code of an operation runs as it stands, and gets what this server answers", async () => {
  const { page } = await shown();
  await page.locator("#operations-models-getModel .opblock-summary-control").click();
  await page.locator("#operations-models-getModel summary").click();
  const codes = page.locator("#operations-models-getModel details pre");
  const names = Object.keys(RUN);
  assert.equal(await codes.count(), names.length);
  for (const [i, name] of names.entries()) {
    const [program, ...options] = RUN[name]!;
    const said = execFileSync(program!, [...options, await codes.nth(i).innerText()]);
    assert.match((JSON.parse(said.toString()) as { identity: string }).identity, /@/, name);
  }
  await page.close();
});

test("an address leads to an operation", async () => {
  const { page } = await shown();
  await page.goto(`${SERVICE}/docs#/models/getModel`);
  await page.reload();
  await page.locator("#operations-models-getModel button.execute").waitFor();
  await page.close();
});
