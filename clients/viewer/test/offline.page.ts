/** The model in the browser answers as the service does, to a tenth of a millimetre. */

import assert from "node:assert/strict";
import { mkdtempSync } from "node:fs";
import type { Server } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, it } from "node:test";

import { Client, type ModelCard, type SigmaGrid, type Trust } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { place, placed } from "../src/skeleton.ts";
import { browser, SERVICE } from "./harness.ts";
import { host, written } from "./static.ts";

/** Metres; float32 in two builds of onnxruntime. */
const NEAR = 1e-4;
const service = new Client(SERVICE);

interface Numbers {
  readonly rotations: ArrayLike<number>;
  readonly rootPosition: ArrayLike<number>;
  readonly boneOffsets: ArrayLike<number>;
}

for (const model of ["reaching", "cmu_walk"]) {
  describe(`${model} without a service`, () => {
    let card: ModelCard;
    let from: Browser;
    let page: Page;
    let server: Server;

    before(async () => {
      card = await service.card(model);
      const folder = mkdtempSync(join(tmpdir(), "posefield-page-"));
      written(model, folder);
      const hosted = await host(folder);
      server = hosted.server;
      from = await browser();
      page = await from.newPage();
      await page.goto(hosted.base);
      await page.evaluate(
        `import("/offline.js").then((part) => part.open("/model.json")).then((source) => { globalThis.source = source; })`,
      );
    });
    after(async () => {
      await from?.close();
      server?.close();
    });

    /** What the model in the browser answers; typed arrays come as lists. */
    const ask = async <Answer>(operation: string, question: object): Promise<Answer> =>
      (await page.evaluate(
        `source.${operation}("${model}", ${JSON.stringify(question)}).then((answer) => JSON.parse(JSON.stringify(answer, (_, value) => ArrayBuffer.isView(value) ? Array.from(value) : value)))`,
      )) as Answer;

    it("says of the model what the service says", async () => {
      // JSON tells no zero of another sign.
      assert.deepEqual(await ask<ModelCard>("card", {}), JSON.parse(JSON.stringify(card)));
    });

    it("poses at every level as the service does", async () => {
      for (const [i, controls] of points(card, 6).entries()) {
        for (const level of card.levels.keys()) {
          const performer = card.performers[i % (card.performers.length + 1)] ?? null;
          const times = [0, 0.2, 0.37, 0.5].map((share) => share * card.durations[0]!);
          const question = { controls, times, level, performer };
          const [own, theirs] = [
            await ask<Numbers>("pose", question),
            // Answers are held to nothing in the browser.
            await service.pose(model, { ...question, exact: "none" }),
          ];
          assert.ok(gap(card, own, theirs) < NEAR, `level ${level}, point ${i}`);
        }
      }
    });

    it("and the check would notice another level and another control", async () => {
      const [controls] = points(card, 1);
      const [control] = card.controls;
      const times = [0, 0.5];
      const theirs = await service.pose(model, { controls: controls!, times });
      const other = { ...controls!, [control!.name]: control!.maximum };
      const coarser = await ask<Numbers>("pose", { controls, times, level: 1 });
      const moved = await ask<Numbers>("pose", { controls: other, times });
      assert.ok(gap(card, coarser, theirs) > NEAR);
      assert.ok(gap(card, moved, theirs) > NEAR);
    });

    it("bounds answers far outside what was sampled as the service does", async () => {
      const first = Object.fromEntries(card.controls.map((own) => [own.name, own.default]));
      for (const { name, minimum, maximum } of card.controls) {
        for (const share of [-8, -0.2, 1.1, 1.6, 9]) {
          const controls = { ...first, [name]: minimum + share * (maximum - minimum) };
          const question = { controls, times: [0, 0.3 * card.durations[0]!] };
          const own = await ask<Numbers & { trust: Trust }>("pose", question);
          const theirs = await service.pose(model, { ...question, exact: "none" });
          assert.ok(gap(card, own, theirs) < NEAR, `${name} ${share}`);
          assert.ok(Math.abs(own.trust.duration - theirs.trust.duration) < NEAR);
          assert.equal(own.trust.band, theirs.trust.band);
          assert.deepEqual(
            own.trust.deviations?.map((each) => [each.control, each.side]),
            theirs.trust.deviations?.map((each) => [each.control, each.side]),
          );
        }
      }
    });

    it("makes clips that travel, stay in place and close", async () => {
      const [controls] = points(card, 1);
      const found = new Map<string, Numbers>();
      for (const root of ["travelling", "in_place"] as const) {
        for (const loop of card.cyclic ? [false, true] : [false]) {
          const question = { controls: controls!, fps: 25, root, loop, level: 1 };
          const [own, theirs] = [
            await ask<Numbers>("clip", question),
            await service.clip(model, { ...question, exact: "none" }),
          ];
          assert.equal(own.rotations.length, theirs.rotations.length);
          assert.ok(gap(card, own, theirs) < NEAR, JSON.stringify(question));
          found.set(`${root} ${loop}`, own);
        }
      }
      assert.ok(gap(card, found.get("travelling false")!, found.get("in_place false")!) > NEAR);
    });

    it("places a crowd and chooses its levels", async () => {
      const many = points(card, 40);
      const controls = Object.fromEntries(
        card.controls.map(({ name }) => [name, many.map((point) => point[name]!)]),
      );
      const position = many.map((_, i) => [3 * i - 50, 0, (7 * i) % 60]);
      const heading = many.map((_, i) => 0.3 * i);
      const camera = { position: [0, 1.7, -12], fov: 0.8, height: 720 };
      for (const rest of [{ level: 2 }, { level: "auto" as const, camera, pixels: 4 }]) {
        const question = { controls, time: 0.3, position, heading, ...rest };
        const [own, theirs] = [
          await ask<Numbers & { levels: number[]; errorPx: number[] | null }>("crowd", question),
          await service.crowd(model, question),
        ];
        assert.deepEqual(own.levels, [...theirs.levels]);
        assert.ok(most(own.rotations, theirs.rotations) < NEAR);
        assert.ok(most(own.rootPosition, theirs.rootPosition) < NEAR);
        assert.ok(most(own.boneOffsets, theirs.boneOffsets) < NEAR);
        if (theirs.errorPx) assert.ok(most(own.errorPx!, theirs.errorPx) < NEAR);
      }
    });

    it("maps sigma", async () => {
      const [across, along] = card.controls.map(({ name }) => name);
      const question = { across: across!, along: along!, columns: 25, rows: 21, margin: 0.3 };
      const [own, theirs] = [
        await ask<SigmaGrid>("sigma", question),
        await service.sigma(model, question),
      ];
      assert.ok(most(own.sigma.flat(), theirs.sigma.flat()) < NEAR);
      assert.ok(most(own.sigma.flat(), theirs.sigma.flat().reverse()) > NEAR);
      assert.ok(most(own.across_values, theirs.across_values) < 1e-9);
      assert.deepEqual(own.inside, theirs.inside);
      assert.deepEqual(own.supported, theirs.supported);
      assert.notDeepEqual(own.supported, own.inside);
    });

    it("shows its page, which says what needs a service", async () => {
      await page.locator(".map-words", { hasText: "Within" }).waitFor();
      await page.locator(".files-said", { hasText: "need a service" }).waitFor();
      assert.equal(await page.locator(".files-get, .files pre").count(), 0);
      assert.equal(await page.getByText("Made of these captured clips").count(), 0);
      assert.equal(await page.getByRole("button", { name: "Ghost" }).count(), 0);
      await page.getByRole("button", { name: "Sticks" }).waitFor();
    });

    it("refuses in words what it cannot answer", async () => {
      const [controls] = points(card, 1);
      const refused = (operation: string, question: object) =>
        assert.rejects(ask(operation, question), (fault: Error) => {
          assert.match(fault.message, /expected|needs a service|no such control/);
          return true;
        });
      await refused("why", { controls });
      await refused("pose", { controls: {}, times: [0] });
      await refused("pose", { controls: { ...controls, nothing: 1 }, times: [0] });
      await refused("pose", { controls, times: [99] });
      await refused("pose", { controls, times: [0], level: 9 });
      await refused("clip", { controls, unit: "cm" });
    });
  });
}

/** Points within what was sampled, the same every time. */
function points(card: ModelCard, count: number): Record<string, number>[] {
  return Array.from({ length: count }, (_, i) =>
    Object.fromEntries(
      card.controls.map(({ name, minimum, maximum }, axis) => {
        const share = ((i + 1) * (axis + 1) * 0.618034) % 1;
        return [name, minimum + share * (maximum - minimum)];
      }),
    ),
  );
}

/** The greatest distance between joints of two answers, m. */
function gap(card: ModelCard, own: Numbers, theirs: Numbers): number {
  const [ours, others] = [joints(card, own), joints(card, theirs)];
  let found = 0;
  for (let i = 0; i < ours.length; i += 3) {
    const apart = [0, 1, 2].map((axis) => ours[i + axis]! - others[i + axis]!);
    found = Math.max(found, Math.hypot(...apart));
  }
  return found;
}

function joints(card: ModelCard, found: Numbers): number[] {
  const { parents } = card.skeleton;
  const out = placed(parents.length);
  const [rotations, roots, offsets] = [found.rotations, found.rootPosition, found.boneOffsets].map(
    (numbers) => Float32Array.from(numbers),
  );
  const frames = roots!.length / 3;
  return Array.from({ length: frames }, (_, frame) => [
    ...place(out, parents, offsets!, rotations!, roots!, frame).positions,
  ]).flat();
}

function most(own: ArrayLike<number>, theirs: ArrayLike<number>): number {
  assert.equal(own.length, theirs.length);
  let found = 0;
  for (let i = 0; i < own.length; i++) found = Math.max(found, Math.abs(own[i]! - theirs[i]!));
  return found;
}
