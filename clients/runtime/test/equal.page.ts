/** Answers of the run time in a browser against the service's, and their CPU time. */

import assert from "node:assert/strict";
import { createReadStream, readFileSync } from "node:fs";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { extname } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import type { Browser, CDPSession, Page } from "playwright-core";
import { build } from "vite";

import { blank, browser } from "../../viewer/test/harness.ts";
import type { Differences, ModelAnswers } from "./answers.ts";

const FILE = process.env["POSEFIELD_ANSWERS"]!;
const MODELS: readonly ModelAnswers[] = JSON.parse(readFileSync(FILE, "utf8"));
const ROOT = fileURLToPath(new URL("browser/", import.meta.url));
const DIST = fileURLToPath(new URL("../.tmp/browser/", import.meta.url));
const TYPES: Record<string, string> = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".wasm": "application/wasm",
};
/** Largest ratios to the service's CPU time. */
const POSE_RATIO = 3;
const CLIP_RATIO = 4;

let chromium: Browser;
let server: Server;
let page: Page;
before(async () => {
  await build({ root: ROOT, configFile: false, logLevel: "error", build: { outDir: DIST } });
  server = createServer((request, response) => {
    const path = request.url === "/" ? "index.html" : request.url!.slice(1);
    const model = MODELS.find(({ file }) => path === `models/${file.split("/").at(-1)}`);
    response.setHeader("content-type", TYPES[extname(path)] ?? "application/octet-stream");
    createReadStream(model ? model.file : DIST + path)
      .on("error", () => response.writeHead(404).end())
      .pipe(response);
  });
  await new Promise<void>((ready) => server.listen(0, "127.0.0.1", ready));
  chromium = await browser();
  page = await blank(chromium);
  await page.goto(`http://127.0.0.1:${(server.address() as AddressInfo).port}/`);
  await page.waitForFunction(() => "posefield" in globalThis);
});
after(async () => {
  await chromium.close();
  server.close();
});

declare const posefield: typeof import("./browser/main.ts");

for (const answers of MODELS)
  test(`${answers.file.split("/").at(-1)} gives the service's answers`, async (context) => {
    const { pose, clip }: Differences = await page.evaluate(
      (expected) => posefield.differences(`models/${expected.file.split("/").at(-1)}`, expected),
      answers,
    );
    context.diagnostic(`poses differ by ${pose.toExponential(1)}, clips by ${1e3 * clip} mm`);
    assert.ok(pose < 1e-5, `poses differ by ${pose}`);
    assert.ok(clip < 1e-4, `joints of clips differ by ${clip} m`);
  });

test("a pose and a clip take little more of the processor than in the service", async (context) => {
  const { file, seconds } = MODELS.find((answers) => answers.file.endsWith("cmu_walk.onnx"))!;
  const url = `models/${file.split("/").at(-1)}`;
  const session = await page.context().newCDPSession(page);
  await session.send("Performance.enable", { timeDomain: "threadTicks" });
  const ratios = { pose: 0, clip: 0 };
  for (const kind of ["pose", "clip"] as const) {
    const run = (count: number) =>
      page.evaluate((task) => posefield.repeat(task.url, task.kind, task.fps, task.count), {
        ...{ url, kind, count, fps: seconds.fps },
      });
    await run(5);
    const count = kind === "pose" ? 500 : 40;
    const begin = await cpu(session);
    await run(count);
    ratios[kind] = ((await cpu(session)) - begin) / count / seconds[kind];
  }
  context.diagnostic(`CPU of a pose ${ratios.pose.toFixed(2)} times the service's`);
  context.diagnostic(`CPU of a clip ${ratios.clip.toFixed(2)} times the service's`);
  assert.ok(ratios.pose > 0 && ratios.pose < POSE_RATIO, `pose: ${ratios.pose}`);
  assert.ok(ratios.clip > 0 && ratios.clip < CLIP_RATIO, `clip: ${ratios.clip}`);
});

test("a frame of walkers takes little of the processor", async (context) => {
  const session = await page.context().newCDPSession(page);
  await session.send("Performance.enable", { timeDomain: "threadTicks" });
  for (const [walkers, limit] of [
    [1, 2],
    [200, 16],
  ] as const) {
    const run = (count: number) =>
      page.evaluate((task) => posefield.walk("models/cmu_walk.onnx", task.walkers, task.count), {
        ...{ walkers, count },
      });
    await run(60);
    const begin = await cpu(session);
    await run(120);
    const milliseconds = (1e3 * ((await cpu(session)) - begin)) / 120;
    context.diagnostic(`${walkers} walkers: ${milliseconds.toFixed(2)} ms of CPU a frame`);
    assert.ok(milliseconds > 0 && milliseconds < limit, `${walkers}: ${milliseconds} ms`);
  }
});

/** CPU seconds of the page's thread. */
async function cpu(session: CDPSession): Promise<number> {
  const { metrics } = await session.send("Performance.getMetrics");
  return metrics.find(({ name }) => name === "TaskDuration")!.value;
}
