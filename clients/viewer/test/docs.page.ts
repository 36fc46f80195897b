/** The page at `/docs` in a browser: the contract in Swagger UI, within the page's content policy. */

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import type { Browser, Page } from "playwright-core";

import { blank, browser, SERVICE } from "./harness.ts";

let chromium: Browser;
before(async () => {
  chromium = await browser();
});
after(() => chromium.close());

/** Open the page; `faults` gathers errors, broken policies and requests to other origins. */
async function shown(path = "/docs"): Promise<{ page: Page; faults: string[] }> {
  const page = await blank(chromium, { viewport: { width: 1280, height: 900 } });
  const faults: string[] = [];
  page.on("pageerror", (fault) => faults.push(String(fault)));
  page.on("console", (line) => {
    if (line.type() === "error") faults.push(line.text());
  });
  page.on("request", (request) => {
    if (!/^(data|blob):/.test(request.url()) && !request.url().startsWith(SERVICE))
      faults.push(request.url());
  });
  await page.goto(`${SERVICE}${path}`);
  await page.locator(".opblock").first().waitFor();
  return { page, faults };
}

test("it draws all operations, loads nothing from elsewhere, and tries one", async () => {
  const { page, faults } = await shown();
  const contract = await (await fetch(`${SERVICE}/openapi.json`)).json();
  const items = Object.values(contract.paths as Record<string, object>);
  const operations = items.flatMap((item) => ["get", "post"].filter((method) => method in item));
  assert.equal(await page.locator(".opblock").count(), operations.length);
  const title = (await page.locator(".info .title").innerText()).replace(/\s+/g, " ");
  assert.match(title, /^posefield \d+\.\d+\.\d+ contract \d+\.\d+\.\d+ /);
  const block = page.locator("#operations-poses-getPose");
  await block.locator(".opblock-summary-control").click();
  await block.getByPlaceholder("model").fill("reaching");
  await block.locator("button.execute").click();
  const status = block.locator(".live-responses-table tbody .response-col_status").first();
  await status.waitFor();
  assert.match(await status.innerText(), /^200/);
  assert.deepEqual(faults, []);
  await page.close();
});

test("an address leads to an operation with parameters", async () => {
  const { page, faults } = await shown("/docs#/clips/getClipInFormat");
  const block = page.locator("#operations-clips-getClipInFormat");
  await block.locator("button.execute").waitFor();
  await block.locator("tr[data-param-name=fps]").waitFor();
  assert.deepEqual(faults, []);
  await page.close();
});
