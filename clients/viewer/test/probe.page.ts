/** Motion files dropped on the page: it says what `posefield probe` says, and nothing leaves the browser. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, dirname, join } from "node:path";
import { after, before, describe, it } from "node:test";

import type { Browser, Page } from "playwright-core";

import { REFUSED } from "../src/probe/formats.ts";
import { limbs } from "../src/probe/limbs.ts";
import { broken } from "./axe.ts";
import { browser, opened } from "./harness.ts";
import { settled, until } from "./look.ts";
import { bvh, glb, usda } from "./probe-files.ts";
import { COMMAND, copied, MODELS } from "./static.ts";

const PYTHON = join(dirname(COMMAND), "python");
const TESTS = new URL("../../../tests/model_export", import.meta.url).pathname;
const SETTINGS = ["metres_per_unit", "up", "fps", "licence"] as const;

interface Proposed {
  readonly value: number | string | null;
  readonly confidence: string;
  readonly evidence: readonly string[];
}

interface Said {
  readonly files: readonly { format: string; frames: number; seconds: number }[];
  readonly joints: readonly string[];
  readonly proposed: Readonly<Record<(typeof SETTINGS)[number], Proposed>>;
  readonly warnings: readonly string[];
}

/** What the command says of files, in one process: its start takes longer than its work. */
function commands(files: readonly string[]): readonly (Said & { readonly error?: string })[] {
  const program = `
import json, sys
from pathlib import Path
from posefield.common.errors import MotionFileError
from posefield_train.probe import probe_report

def said(name):
    try:
        return probe_report.probe([Path(name)]).facts()
    except MotionFileError as fault:
        return {"error": str(fault)}

print(json.dumps([said(name) for name in sys.argv[1:]]))`;
  return JSON.parse(execFileSync(PYTHON, ["-c", program, ...files]).toString());
}

/** Drops files on the page, as from a folder. */
async function drop(page: Page, ...files: readonly string[]): Promise<void> {
  const packed = files.map((file) => [basename(file), readFileSync(file).toString("base64")]);
  await page.evaluate((packed) => {
    const held = new DataTransfer();
    for (const [name, text] of packed as [string, string][]) {
      const content = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      held.items.add(new File([content], name));
    }
    const shared = { dataTransfer: held, bubbles: true, cancelable: true };
    document.body.dispatchEvent(new DragEvent("dragover", shared));
    document.body.dispatchEvent(new DragEvent("drop", shared));
  }, packed);
  await page
    .locator("dialog.probe article")
    .nth(files.length - 1)
    .waitFor();
}

/** What the page says of the only file. */
async function shown(page: Page): Promise<Said> {
  const article = page.locator("dialog.probe article");
  const said = await article.locator("> p").first().innerText();
  const [, format = "", frames, seconds] = /^(\w+) file, (\d+) frames, (\S+) s$/.exec(said) ?? [];
  const joints = await article.locator("[data-fact=joints] > span").first().innerText();
  const proposed: Record<string, Proposed> = {};
  for (const name of SETTINGS) {
    const row = article.locator(`[data-fact=${name}]`);
    const [value = "", confidence = ""] = await row.locator("> span").allInnerTexts();
    const evidence = await row.locator("li").allInnerTexts();
    const bare = value.replace(/ (m|frames a second)$/, "");
    proposed[name] = {
      value: bare === "unknown" ? null : name === "up" ? bare : Number(bare),
      confidence: /confidence: (\w+)/.exec(confidence)?.[1] ?? "",
      evidence,
    };
  }
  return {
    files: [{ format, frames: Number(frames), seconds: Number(seconds) }],
    joints: joints.split(", "),
    proposed: proposed as Said["proposed"],
    warnings: await article.locator(".warnings li").allInnerTexts(),
  };
}

/** The parts of what the command says that the page says too, as it shows them. */
function comparable({ files, joints, proposed, warnings }: Said): Said {
  const [{ format, frames, seconds }] = files as [Said["files"][number]];
  const kept = Object.fromEntries(SETTINGS.map((name) => [name, proposed[name]]));
  return {
    files: [{ format, frames, seconds: Number(seconds.toFixed(2)) }],
    joints,
    proposed: kept as Said["proposed"],
    warnings,
  };
}

const folder = mkdtempSync(join(tmpdir(), "posefield-probe-"));
function written(name: string, content: string | Uint8Array): string {
  const path = join(folder, name);
  writeFileSync(path, content);
  return path;
}
function clip(name: string, ...options: readonly string[]): string {
  const path = join(folder, name);
  const model = join(MODELS, "cmu_walk.onnx");
  execFileSync(COMMAND, ["clip", model, "-c", "speed=1.3", ...options, "-o", path], {
    stdio: "pipe",
  });
  return path;
}

let from: Browser;
before(async () => {
  from = await browser();
});
after(() => from.close());

describe("a file that is dropped", () => {
  let page: Page;
  let faults: string[];
  const asked = new Set<string>();
  before(async () => {
    ({ page, faults } = await opened(from, "/#cmu_walk?~playing=no"));
    await settled(page);
    page.on("request", (request) => {
      const { pathname, protocol } = new URL(request.url());
      // The page may still ask which clips are nearest to its own motion.
      if (protocol === "http:" && !pathname.endsWith("/why"))
        asked.add(`${request.method()} ${pathname} ${request.postData()}`);
    });
  });
  after(() => page.close());

  const same = async (files: readonly string[]) => {
    for (const [index, said] of commands(files).entries()) {
      await drop(page, files[index]!);
      assert.deepEqual(await shown(page), comparable(said), files[index]);
    }
  };

  it("is told as by the command: clips of every format", async () => {
    const files = ["bvh", "glb", "usda", "usdc", "usdz"].map((suffix) => clip(`walk.${suffix}`));
    await same([...files, clip("high.usdc", "--up", "z", "--unit", "cm")]);
    const said = JSON.parse(execFileSync(COMMAND, ["probe", files[3]!, "--json"]).toString());
    await drop(page, files[3]!);
    assert.deepEqual(await shown(page), comparable(said as Said));
  });

  it("is told as by the command: files that others made", () =>
    same([
      written("plain.bvh", bvh({ frames: 40 })),
      written("high.bvh", bvh({ frames: 40, up: "z", scale: 10, seconds: 0.0083333 })),
      written("plain.glb", glb()),
      written("bare.glb", glb({ skinned: false })),
      written("plain.usda", usda()),
      written("silent.usda", usda({ stated: false })),
    ]));

  it("that is changed is told otherwise", async () => {
    const before = written("before.bvh", bvh({ frames: 40 }));
    await drop(page, before);
    const found = await shown(page);
    const after = written("before.bvh", bvh({ frames: 41, up: "z", scale: 10, seconds: 0.02 }));
    await drop(page, after);
    const changed = await shown(page);
    for (const name of ["metres_per_unit", "up", "fps"] as const)
      assert.notEqual(changed.proposed[name].value, found.proposed[name].value, name);
    const [said] = commands([after]);
    assert.notDeepEqual(found, comparable(said!));
    assert.deepEqual(changed, comparable(said!));
  });

  it("that lacks a part says so in the command's words", async () => {
    const two = [
      [0, 0.1, 0.2],
      [0, 0.1],
    ];
    const files = [
      written("still.usda", usda({ animation: false })),
      written("boneless.usda", usda({ skeleton: false })),
      written("still.glb", glb({ keys: [] })),
      written("two.glb", glb({ keys: two })),
    ];
    for (const [index, { error = "" }] of commands(files).entries()) {
      await drop(page, files[index]!);
      const [said] = await page.locator("dialog.probe .warnings li").allInnerTexts();
      assert.ok(error.includes(said!), `${said} / ${error}`);
    }
  });

  it("that is damaged or of another format is refused by both", async () => {
    const whole = readFileSync(join(folder, "walk.usdc"));
    const packed = readFileSync(join(folder, "walk.usdz"));
    const damaged = [
      ["cut.bvh", bvh().slice(0, -20), /the file is not whole/],
      ["cut.glb", glb().slice(0, -20), /expected a whole file/],
      ["cut.usda", usda().slice(0, -60), /the file is not whole/],
      ["cut.usdc", whole.subarray(0, whole.length / 2), /does not open as USD/],
      ["cut.usdz", packed.subarray(0, 9000), /the file is not whole/],
    ] as const;
    const others = Object.keys(REFUSED).map((suffix) => [`kick${suffix}`, "x", /./] as const);
    const all = [...damaged, ...others];
    const files = all.map(([name, content]) => written(name, content));
    for (const [index, { error = "" }] of commands(files).entries()) {
      const [name, , expected] = all[index]!;
      await drop(page, files[index]!);
      const said = await page.locator("dialog.probe .fault").innerText();
      assert.match(said, expected, name);
      assert.ok(error, `the command reads ${name}`);
      if (index >= damaged.length) assert.ok(error.includes(said), `${said} / ${error}`);
    }
  });

  it("comes with others, each told by itself", async () => {
    await drop(page, join(folder, "walk.bvh"), join(folder, "kick.fbx"), join(folder, "walk.glb"));
    await page.locator(".probe-said", { hasText: "3 files, 1 of them not read." }).waitFor();
  });

  it("and nothing was asked of anybody, and nothing else went wrong", () => {
    // The page looks every few seconds which models there are.
    assert.deepEqual([...asked], ["GET /v1/models null"]);
    assert.deepEqual(faults, []);
  });
});

it("names of joints are understood as by the command, in all conventions of its tests", () => {
  const program = `
import json, skeleton_tables
from posefield.roles import joint_recognition
tables = ("development", "held_out", "held_out_later", "held_out_last")
print(json.dumps([
    [s.names, s.parents, {r: g.joint for r, g in joint_recognition.recognise(s.names, s.parents).items()}]
    for table in tables for s in skeleton_tables.read(table).values()
]))`;
  const env = { ...process.env, PYTHONPATH: `${TESTS}:${process.env["PYTHONPATH"] ?? ""}` };
  const all = JSON.parse(execFileSync(PYTHON, ["-c", program], { env }).toString()) as [
    string[],
    number[],
    Record<string, string>,
  ][];
  assert.ok(all.length > 40);
  for (const [names, parents, roles] of all) {
    const own = Object.fromEntries(
      [...limbs(names, parents)].map(([role, at]) => [role, names[at]]),
    );
    const limbsOnly = Object.entries(roles).filter(([role]) => /^(left|right|head)/.test(role));
    assert.deepEqual(own, Object.fromEntries(limbsOnly), names.slice(0, 4).join());
  }
});

it("a large file leaves the page at work", async () => {
  const { page } = await opened(from, "/#cmu_walk?~playing=no");
  await settled(page);
  const rows = bvh({ frames: 200_000 });
  const { took, gap } = await page.evaluate(async (text) => {
    const held = new DataTransfer();
    held.items.add(new File([text], "long.bvh"));
    let last = performance.now();
    let gap = 0;
    const ticks = setInterval(() => {
      gap = Math.max(gap, performance.now() - last);
      last = performance.now();
    }, 5);
    const begun = last;
    document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: held, bubbles: true }));
    while (!document.querySelector("dialog.probe article"))
      await new Promise((done) => setTimeout(done, 5));
    clearInterval(ticks);
    return { took: performance.now() - begun, gap };
  }, rows);
  assert.ok(gap < took / 2, `stood still for ${gap} of ${took} ms`);
  assert.match(await page.locator("dialog.probe article").innerText(), /200000 frames/);
  await page.close();
});

it("without a mouse: a button chooses files, Escape closes, and the focus returns", async () => {
  const { page } = await opened(from, "/#cmu_walk?~playing=no");
  await settled(page);
  const button = page.getByRole("button", { name: "Choose files…" });
  const [chooser] = await Promise.all([page.waitForEvent("filechooser"), button.press("Enter")]);
  await chooser.setFiles(written("kick.bvh", bvh({ frames: 10 })));
  const dialog = page.getByRole("dialog", { name: "Motion files" });
  await dialog.waitFor();
  await page
    .getByRole("status")
    .filter({ hasText: "kick.bvh: BVH file, 10 frames, 0.09 s." })
    .waitFor();
  await page.keyboard.press("Escape");
  await dialog.waitFor({ state: "hidden" });
  assert.ok(await button.evaluate((each) => each === document.activeElement));
  await page.close();
});

for (const scheme of ["light", "dark"] as const)
  it(`everybody can read it, ${scheme}`, async () => {
    const page = await from.newPage({
      colorScheme: scheme,
      bypassCSP: true,
      viewport: { width: 390, height: 844 },
    });
    await page.goto(new URL("/#cmu_walk?~playing=no", process.env["POSEFIELD_URL"]).href);
    await settled(page);
    await drop(
      page,
      written("kick.bvh", bvh()),
      written("kick.fbx", "x"),
      written(
        "two.glb",
        glb({
          keys: [
            [0, 0.1],
            [0, 0.1],
          ],
        }),
      ),
    );
    assert.deepEqual(await broken(page), []);
    const wide = await page
      .locator("dialog.probe")
      .evaluate((each) => each.scrollWidth - each.clientWidth);
    assert.ok(wide <= 0, `${wide} px too wide`);
    await page.close();
  });

it("a veil shows where files may be dropped, for files alone", async () => {
  const { page } = await opened(from, "/#cmu_walk?~playing=no");
  await settled(page);
  const over = (kind: "file" | "text") =>
    page.evaluate((kind) => {
      const held = new DataTransfer();
      if (kind === "file") held.items.add(new File(["x"], "x.bvh"));
      else held.setData("text/plain", "x");
      document.body.dispatchEvent(new DragEvent("dragover", { dataTransfer: held, bubbles: true }));
    }, kind);
  const veil = page.locator(".probe-veil");
  await over("text");
  assert.ok(await veil.isHidden());
  await over("file");
  await until(() => veil.isVisible(), "the veil is shown");
  await page.evaluate(() =>
    document.body.dispatchEvent(new DragEvent("dragleave", { bubbles: true })),
  );
  assert.ok(await veil.isHidden());
  await page.close();
});

it("a copy without a service reads files too", async () => {
  const { address } = copied("reaching", folder);
  const page = await from.newPage();
  await page.goto(address);
  await page.locator("#stage canvas").waitFor();
  await drop(page, written("kick.bvh", bvh({ frames: 10 })));
  assert.match(
    await page.locator("dialog.probe article").innerText(),
    /BVH file, 10 frames, 0.09 s/,
  );
  await page.close();
});
