/** A copy without a service answers from its table: at the table's points as the service does. */

import assert from "node:assert/strict";
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, it } from "node:test";

import { Client, type ModelCard, type SigmaGrid, type Trust } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { place, placed } from "../src/skeleton.ts";
import { centimetres } from "../src/written.ts";
import { browser, SERVICE } from "./harness.ts";
import { type Copy, copied } from "./static.ts";

/** The copy's error at points of its table was measured at 200 of them: others may lie this much
 * further off. */
const ROOM = 1.5;
const service = new Client(SERVICE);

interface Numbers {
  readonly rotations: ArrayLike<number>;
  readonly rootPosition: ArrayLike<number>;
  readonly boneOffsets: ArrayLike<number>;
}

type Asked = Numbers & { readonly trust: Trust; readonly times: readonly number[] };
type Controls = Record<string, number>;

for (const model of ["reaching", "cmu_walk"]) {
  describe(`${model} without a service`, () => {
    let card: ModelCard;
    let copy: Copy;
    /** Metres at a point of the table, by what the copy states of itself. */
    let near: number;
    let from: Browser;
    let page: Page;
    const faults: string[] = [];

    before(async () => {
      card = await service.card(model);
      copy = copied(model, mkdtempSync(join(tmpdir(), "posefield-page-")));
      near = ROOM * copy.errors.stored;
      from = await browser();
      page = await from.newPage();
      page.on("pageerror", (fault) => faults.push(String(fault)));
      page.on("console", (line) => {
        if (line.type() === "error") faults.push(line.text());
      });
      page.on("request", (request) => {
        if (/^https?:/.test(request.url())) faults.push(request.url());
      });
      await page.goto(copy.address);
      await page.locator("#stage[data-clip]").waitFor();
    });
    after(() => from?.close());

    /** What the copy answers; typed arrays come as lists. */
    const ask = async <Answer>(operation: string, question: object): Promise<Answer> =>
      (await page.evaluate(
        `posefieldCopy.${operation}("${model}", ${JSON.stringify(question)}).then((answer) => JSON.parse(JSON.stringify(answer, (_, value) => ArrayBuffer.isView(value) ? Array.from(value) : value)))`,
      )) as Answer;

    /** The service's poses at the same shares of its clip as a clip that the copy has given, but
     * for the last: the service refuses a time after its end, by rounding too. */
    const theirs = async (controls: Controls, { times, trust }: Asked) => {
      const question = {
        controls,
        performer: trust.performer ?? null,
        level: trust.level ?? 0,
        exact: "none" as const,
      };
      const { duration } = (await service.pose(model, { ...question, times: [0] })).trust;
      const own = times.slice(0, -1).map((time) => (time * duration) / trust.duration);
      return service.pose(model, { ...question, times: own });
    };

    it("says of the model what the service says", async () => {
      // JSON tells no zero of another sign.
      assert.deepEqual(await ask<ModelCard>("card", {}), JSON.parse(JSON.stringify(card)));
    });

    it("has the service's joints at ends of the sampled ranges, points of the table", async () => {
      for (const [i, controls] of ends(card).entries()) {
        const level = i % card.levels.length;
        const performer = card.performers[i % (card.performers.length + 1)] ?? null;
        const own = await ask<Asked>("clip", { controls, level, performer });
        const found = await theirs(controls, own);
        assert.ok(Math.abs(own.trust.duration - found.trust.duration) < 1e-3);
        assert.ok(Math.abs(own.trust.sigma - found.trust.sigma) < 1e-3);
        assert.equal(own.trust.supported, found.trust.supported);
        assert.equal(own.trust.band, found.trust.band);
        const apart = gap(card, own, found);
        assert.ok(apart < near, `${apart} m at level ${level}, ${JSON.stringify(controls)}`);
      }
    });

    it("lies between them no further off than it says", async () => {
      for (const part of [0.21, 0.37, 0.5, 0.68, 0.83]) {
        const controls = inside(card, part);
        const own = await ask<Asked>("clip", { controls });
        const apart = gap(card, own, await theirs(controls, own));
        assert.ok(
          apart < copy.errors.worst,
          `${apart} m at ${part}, ${copy.errors.worst} m stated`,
        );
      }
    });

    it("has the service's character", async () => {
      const { content } = await ask<{ content: number[] }>("character", {});
      assert.deepEqual(content, [...(await service.character(model)).content]);
    });

    it("and the check would notice another level and another control", async () => {
      const [low, , , , , high] = ends(card);
      const own = await ask<Asked>("clip", { controls: low });
      assert.ok(gap(card, await ask<Asked>("clip", { controls: low, level: 3 }), own) > near);
      assert.ok(gap(card, await ask<Asked>("clip", { controls: high }), own) > near);
    });

    it("stays in place as the service does", async () => {
      const [controls] = ends(card) as [Controls];
      const question = { controls, root: "in_place" as const };
      const own = await ask<Asked>("clip", question);
      const fps = (own.times.length - 1) / own.trust.duration;
      const feet = "as_predicted" as const;
      const found = await service.clip(model, { ...question, fps, exact: "none", feet });
      assert.ok(Math.abs(found.frames - own.times.length) <= 1);
      assert.ok(gap(card, own, found) < near);
      assert.ok(gap(card, await ask<Asked>("clip", { controls }), own) > near);
    });

    it("has no takes and no feet that stand, says so, and has no dead button", async () => {
      const state = "~take=7&~variety=0.4&~fan=yes&~stands=no";
      await page.evaluate((hash) => {
        location.hash = hash;
      }, `#${model}?${state}`);
      await page.getByText("Other takes of the motion need a service").waitFor();
      const why = card.feet.length ? /only a service makes them stand/ : /names no feet/;
      await page.locator("[data-feet]", { hasText: why }).waitFor();
      for (const name of ["Next take", "Prediction", "Fan of other takes", "Feet stand"])
        assert.equal(await page.getByRole("button", { name }).count(), 0, name);
      for (const key of ["n", "v", "s"]) await page.keyboard.press(key);
      assert.equal(await page.locator("[data-fan]").count(), 0);
      assert.ok((await page.locator("#notice p").allInnerTexts()).every((text) => !text));
      const [controls] = ends(card) as [Controls];
      for (const more of [{ take: 7 }, { feet: "stand" }])
        await assert.rejects(ask("clip", { controls, ...more }), /needs a service/);
    });

    it("poses a crowd as its clips", async () => {
      const rows = ends(card);
      const joints = card.skeleton.parents.length;
      const controls = Object.fromEntries(
        card.controls.map(({ name }) => [name, rows.map((row) => row[name]!)]),
      );
      const crowd = await ask<Numbers & { duration: number[] }>("crowd", { controls, time: 0.3 });
      for (const [i, own] of rows.entries()) {
        const one = await ask<Asked>("pose", { controls: own, times: [0.3] });
        const part = (all: ArrayLike<number>, size: number) =>
          Array.from(all).slice(i * size, (i + 1) * size);
        const row = {
          rotations: part(crowd.rotations, 4 * joints),
          rootPosition: part(crowd.rootPosition, 3),
          boneOffsets: part(crowd.boneOffsets, 3 * joints),
        };
        assert.ok(gap(card, row, one) < 1e-6);
        assert.ok(Math.abs(crowd.duration[i]! - one.trust.duration) < 1e-6);
      }
    });

    it("maps sigma and support", async () => {
      const [across, along] = card.controls.map(({ name }) => name);
      const question = { across: across!, along: along!, columns: 25, rows: 21, margin: 0.25 };
      const own = await ask<SigmaGrid>("sigma", question);
      const found = await service.sigma(model, question);
      assert.deepEqual(own.inside, found.inside);
      assert.ok(most(own.sigma.flat(), found.sigma.flat()) < ROOM * copy.errors.sigma);
      const held = found.supported!.flat();
      const other = own.supported!.flat().filter((each, i) => each !== held[i]);
      const share = other.length / held.length;
      // The map is one plane through the controls: more of it may be near the border of support.
      assert.ok(share < 3 * copy.errors.support, `${share} differ, ${copy.errors.support} stated`);
    });

    it("says how far its answers are off and what needs a service", async () => {
      const note = page.locator("[data-part=copy]");
      await note.getByText(`between ${copy.answers.toLocaleString("en")} answers`).waitFor();
      await note.getByText(`${centimetres(copy.errors.worst)} at most`).waitFor();
      await page.locator(".map-words", { hasText: "Within" }).waitFor();
      await page.locator(".files-said", { hasText: "need a service" }).waitFor();
      await page.getByRole("button", { name: "Performance", exact: true }).click();
      await page.getByText("A performance needs a service").waitFor();
      await page.getByRole("button", { name: "Single", exact: true }).click();
      assert.equal(await page.locator(".files-get, .files pre").count(), 0);
      assert.equal(await page.getByText("Made of these captured clips").count(), 0);
      assert.equal(await page.getByRole("button", { name: "Ghost" }).count(), 0);
      await page.getByRole("button", { name: "Sticks" }).waitFor();
    });

    it("shows a crowd and asks no one for anything", async () => {
      await page.getByRole("button", { name: "Crowd" }).click();
      // As many characters at each level as the panel says.
      await page.waitForFunction(
        `[...document.querySelectorAll("section.crowd b")].some((each) => Number(each.textContent) > 0)`,
      );
      assert.deepEqual(faults, []);
    });

    it("refuses in words what it cannot answer", async () => {
      const [controls] = ends(card);
      const [first] = card.controls;
      const beyond = { ...controls, [first!.name]: 3 * first!.maximum };
      const refused = (operation: string, question: object) =>
        assert.rejects(
          ask(operation, question),
          /expected|needs a service|no such (control|label set)/,
        );
      await refused("why", { controls });
      await refused("pose", { controls: {}, times: [0] });
      await refused("pose", { controls: { ...controls, nothing: 1 }, times: [0] });
      await refused("pose", { controls: beyond, times: [0] });
      await refused("pose", { controls, times: [99] });
      await refused("pose", { controls, times: [0], level: 9 });
      await refused("clip", { controls, unit: "cm" });
      await refused("clip", { controls, labels: { hat: "red" } });
      await refused("crowd", { controls, time: 0, level: "auto" });
    });
  });
}

/** The same share of every sampled range. */
function inside(card: ModelCard, part: number): Controls {
  return Object.fromEntries(
    card.controls.map(({ name, minimum, maximum }) => [name, minimum + part * (maximum - minimum)]),
  );
}

/** Ends of the sampled ranges in several combinations. */
function ends(card: ModelCard): Controls[] {
  return Array.from({ length: 6 }, (_, i) =>
    Object.fromEntries(
      card.controls.map(({ name, minimum, maximum }, axis) => [
        name,
        [minimum, maximum][(i >> axis) & 1]!,
      ]),
    ),
  );
}

/** The greatest distance between joints of two answers, m, in the frames that both have. */
function gap(card: ModelCard, own: Numbers, theirs: Numbers): number {
  const [ours, others] = [joints(card, own), joints(card, theirs)];
  let found = 0;
  for (let i = 0; i < Math.min(ours.length, others.length); i += 3) {
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
