/** The page of the README, packed as it stands, in a browser: the figure walks by keys. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cpSync, createReadStream, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { extname } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { build } from "vite";

import { blank, browser } from "../../viewer/test/harness.ts";

const COMMAND = process.env["POSEFIELD_COMMAND"] ?? "posefield";
const PACKAGE = fileURLToPath(new URL("../", import.meta.url));
const FOLDER = `${PACKAGE}.tmp/readme-page/`;
const MODEL = fileURLToPath(
  new URL("../../../service/posefield/shipped/cmu_walk.onnx", import.meta.url),
);
const TYPES: Record<string, string> = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".wasm": "application/wasm",
};

test("the page of the README shows a figure that keys move", async () => {
  const text = readFileSync(`${PACKAGE}README.md`, "utf8");
  const html = /`index\.html` is `(.+?)`/.exec(text)![1]!;
  const script = /^```js browser\n(.*?)^```$/ms.exec(text)![1]!;
  mkdirSync(`${FOLDER}public`, { recursive: true });
  cpSync(MODEL, `${FOLDER}public/cmu_walk.onnx`);
  const [, words] = /^posefield (clip .+?) +#/m.exec(text)!;
  execFileSync(COMMAND, words!.split(" "), { cwd: FOLDER, stdio: "ignore" });
  writeFileSync(`${FOLDER}index.html`, `<link rel="icon" href="data:,">${html}`);
  const shown = "Object.assign(globalThis, { walkers, bones });";
  writeFileSync(`${FOLDER}main.js`, `${script}\n${shown}\n`);
  await build({ root: FOLDER, configFile: false, logLevel: "error" });
  const asked: string[] = [];
  const server = createServer((request, response) => {
    const path = request.url === "/" ? "index.html" : request.url!.slice(1);
    asked.push(path);
    response.setHeader("content-type", TYPES[extname(path)] ?? "application/octet-stream");
    createReadStream(`${FOLDER}dist/${path}`)
      .on("error", () => response.writeHead(404).end())
      .pipe(response);
  });
  await new Promise<void>((ready) => server.listen(0, "127.0.0.1", ready));
  const chromium = await browser();
  try {
    const page = await blank(chromium);
    const faults: string[] = [];
    page.on("pageerror", (fault) => faults.push(String(fault)));
    const place = () => page.evaluate("walkers.state(0).z") as Promise<number>;
    await page.goto(`http://127.0.0.1:${(server.address() as AddressInfo).port}/`);
    await page.waitForFunction("globalThis.walkers");
    const stands = await place();
    await page.keyboard.down("ArrowUp");
    await page.waitForFunction("walkers.state(0).z > 1");
    await page.waitForFunction(
      "bones[5].matrixWorld.elements[14] > 1 && !bones.includes(undefined)",
    );
    assert.equal(stands, 0);
    assert.deepEqual(faults, []);
    assert.equal(asked.filter((path) => path.endsWith(".wasm")).length, 1);
  } finally {
    await chromium.close();
    server.close();
  }
});
