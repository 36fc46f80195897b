/** The map of two controls: sigma as the service says, dots, clicks, keys and words. */

import assert from "node:assert/strict";
import { after, before, describe, it } from "node:test";

import { Client, type ModelCard, type SigmaGrid } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { extent, Frame, MARGIN, viridis } from "../src/chart.ts";
import { browser, opened, SERVICE } from "./harness.ts";
import { until } from "./look.ts";

const client = new Client(SERVICE);
const FIGURE = /[−-]?[\d.]+/g;

describe("the map", () => {
  let from: Browser;
  let page: Page;
  let card: ModelCard;
  let faults: string[];

  before(async () => {
    from = await browser();
    ({ page, faults } = await opened(from, "/#reaching"));
    card = await client.card("reaching");
    await page.locator(".map").getByLabel("across", { exact: true }).selectOption("turn");
    await page.locator(".map").getByLabel("up", { exact: true }).selectOption("target_height");
    await page.locator(".map-words", { hasText: "Within" }).waitFor();
    await settled(page, "turn, rows: target_height");
  });
  after(() => from.close());

  const here = async (): Promise<number[]> => {
    const said = await page.locator(".map-here").innerText();
    return [...said.split(";")[0]!.matchAll(FIGURE)].map(([text]) =>
      Number(text!.replace("−", "-")),
    );
  };
  const box = async () => {
    await page.locator(".map-canvas").scrollIntoViewIfNeeded();
    return (await page.locator(".map-canvas").boundingBox())!;
  };
  const control = (name: string) => card.controls.find((each) => each.name === name)!;
  /** Values of the controls that are no axes, as their fields say. */
  const others = async () => {
    const hash = new URLSearchParams(new URL(page.url()).hash.split("?")[1]);
    const rest = card.controls.filter(({ name }) => !["turn", "target_height"].includes(name));
    return Object.fromEntries(
      rest.map(({ name, default: usual }) => {
        // Open controls have the mark ~ before the value that was inferred.
        return [name, Number((hash.get(name) ?? `${usual}`).replace("~", ""))];
      }),
    );
  };
  const colours = (spots: readonly (readonly [number, number])[]): Promise<number[][]> =>
    page.locator(".map-canvas").evaluate((canvas, places) => {
      const own = canvas as HTMLCanvasElement;
      const ratio = own.width / own.clientWidth;
      const whole = own.getContext("2d")!.getImageData(0, 0, own.width, own.height);
      return places.map(([x, y]) => {
        const from = 4 * (Math.floor(y * ratio) * own.width + Math.floor(x * ratio));
        return [...whole.data.slice(from, from + 3)];
      });
    }, spots);
  const gap = (one: readonly number[], other: readonly number[]) =>
    Math.max(...one.map((value, i) => Math.abs(value - other[i]!)));
  const frame = async () => {
    const { width, height } = await box();
    return new Frame(control("turn"), control("target_height"), width, height);
  };
  const at = async (turn: number, height: number) => {
    const [place, { x, y }] = [await frame(), await box()];
    return [x + place.x(turn), y + place.y(height)] as const;
  };

  it("says the least and the greatest sigma that the service answers with", async () => {
    const question = {
      across: "turn",
      along: "target_height",
      columns: 48,
      rows: 36,
      margin: MARGIN,
    };
    const grid = await client.sigma("reaching", question);
    const near = grid.sigma.flatMap((row, i) => row.filter((_, j) => grid.supported![i]![j]));
    const [least, most] = [100 * Math.min(...near), 100 * Math.max(...near)];
    const said = async () => {
      const words = await page.locator(".map-words").innerText();
      return [...words.matchAll(/([\d.]+) cm/g)].map(([, text]) => Number(text));
    };
    // On a busy machine it may still say what its first axes had.
    for (let i = 0; i < 100 && !(Math.abs((await said())[0]! - least) < 0.006 * least); i++) {
      await page.waitForTimeout(100);
    }
    const [low, high] = await said();
    assert.ok(Math.abs(low! - least) < 0.006 * least, `${low} for ${least}`);
    assert.ok(Math.abs(high! - most) < 0.006 * most, `${high} for ${most}`);
    assert.ok(Math.abs(most - least) > 0.006 * most);
  });

  it("goes where one clicks and drags", async () => {
    // Beyond what was sampled there is no dot to be meant instead.
    const { minimum, maximum } = control("turn");
    const beyond = minimum - 0.15 * (maximum - minimum);
    await page.mouse.click(...(await at(beyond, 1.2)));
    const [turn, height] = await here();
    assert.ok(
      Math.abs(turn! - beyond) < 1.5 && Math.abs(height! - 1.2) < 0.03,
      `${turn} ${height}`,
    );
    await page.mouse.move(...(await at(0, 1.4)));
    await page.mouse.down();
    await page.mouse.move(...(await at(60, 0.5)), { steps: 4 });
    await page.mouse.up();
    const [later, lower] = await here();
    assert.ok(Math.abs(later! - 60) < 1.5 && Math.abs(lower! - 0.5) < 0.03, `${later} ${lower}`);
  });

  it("moves by arrows and goes to examples by page keys", async () => {
    await page.locator(".map-canvas").focus();
    const before = await here();
    await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("ArrowUp");
    const now = await here();
    const { minimum, maximum } = control("turn");
    assert.ok(Math.abs(before[0]! - now[0]! - 0.02 * (maximum - minimum)) < 0.2);
    assert.ok(now[1]! > before[1]!);
    await page.keyboard.press("PageDown");
    assert.match(await page.locator(".map-here").innerText(), /, exactly$/);
    await page.keyboard.press("Shift+ArrowRight");
    assert.doesNotMatch(await page.locator(".map-here").innerText(), /exactly/);
  });

  it("names a captured clip under the pointer and goes to all of its controls", async () => {
    const [x, y] = ["turn", "target_height"].map((name) =>
      card.controls.findIndex((each) => each.name === name),
    );
    const values = card.examples[40]!;
    const place = await at(values[x!]!, values[y!]!);
    await page.mouse.move(...place);
    await page.locator(".map-tip").waitFor({ state: "visible" });
    const tip = await page.locator(".map-tip").innerText();
    const index = card.sources.indexOf(tip.match(/reach_\d+\.bvh/)![0]);
    const said = Number(tip.match(/left out: ([\d.]+) cm away/)![1]);
    assert.ok(Math.abs(said - 100 * card.left_out![index]!) < 0.006 * said, tip);
    assert.ok(Math.abs(said - 100 * card.left_out![(index + 1) % 92]!) > 0.006 * said);
    await page.mouse.click(...place);
    assert.match(await page.locator(".map-here").innerText(), /reach_\d+\.bvh, exactly$/);
    await page.mouse.move(5, 5);
    await page.locator(".map-tip").waitFor({ state: "hidden" });
  });

  it("stays with a clip where the finger trembles, and goes along where it moves", async () => {
    const [x, y] = ["turn", "target_height"].map((name) =>
      card.controls.findIndex((each) => each.name === name),
    );
    const [left, top] = await at(card.examples[40]![x!]!, card.examples[40]![y!]!);
    await page.mouse.move(left, top);
    await page.mouse.down();
    await page.mouse.move(left + 2, top + 1);
    assert.match(await page.locator(".map-here").innerText(), /exactly$/);
    await page.mouse.move(left + 9, top + 1);
    assert.doesNotMatch(await page.locator(".map-here").innerText(), /exactly$/);
    await page.mouse.up();
    await page.mouse.move(5, 5);
  });

  interface Bare {
    readonly at: readonly [number, number];
    readonly sigma: number;
    readonly supported: boolean;
    readonly inside: boolean;
  }

  /** Points of the map where no dot, no ring, no line of the cross, no frame and no outline lies. */
  const bare = async (): Promise<{ grid: SigmaGrid; points: Bare[] }> => {
    const grid = await client.sigma("reaching", {
      across: "turn",
      along: "target_height",
      columns: 48,
      rows: 36,
      margin: MARGIN,
      controls: await others(),
    });
    const [x, y] = ["turn", "target_height"].map((name) =>
      card.controls.findIndex((each) => each.name === name),
    );
    const place = await frame();
    const [crossX, crossY] = [place.x((await here())[0]!), place.y((await here())[1]!)];
    const dots = card.examples.map(
      (values) => [place.x(values[x!]!), place.y(values[y!]!)] as const,
    );
    const [edgeX, edgeY, wide, tall] = place.range;
    const lines = [
      [crossX, edgeX, edgeX + wide],
      [crossY, edgeY, edgeY + tall],
    ];
    const alone = (row: number, column: number): boolean =>
      [-1, 0, 1].every((up) =>
        [-1, 0, 1].every((right) => {
          const beside = grid.supported![row + up]?.[column + right];
          return beside === grid.supported![row]![column];
        }),
      );
    const points = grid.along_values.flatMap((up, row) =>
      grid.across_values.flatMap((right, column) => {
        const at = [place.x(right), place.y(up)] as const;
        const far = dots.every((dot) => Math.hypot(dot[0] - at[0], dot[1] - at[1]) > 11);
        const [cross, ...frame] = [0, 1, 2].map((line) =>
          Math.min(...lines.map((each, axis) => Math.abs(each[line]! - at[axis]!))),
        );
        const free = far && cross! > 10 && Math.min(...frame) > 3 && alone(row, column);
        const [supported, inside] = [grid.supported, grid.inside].map((all) => all![row]![column]!);
        const sigma = grid.sigma[row]![column]!;
        return free ? [{ at, sigma, supported: supported!, inside: inside! }] : [];
      }),
    );
    return { grid, points };
  };

  /** Pixels of the map without its sigma's colour; the address and the map may still be on their way. */
  const miscoloured = async (): Promise<string> => {
    const { grid, points } = await bare();
    const near = points
      .filter(({ supported }) => supported)
      .sort((one, other) => one.sigma - other.sigma);
    assert.ok(near.length > 1, `${near.length} bare places`);
    const [low, high] = extent(grid);
    const ends = [near[0]!, near.at(-1)!];
    const found = await colours(ends.map(({ at: spot }) => spot));
    const seen = ends.map(({ sigma }, i) => {
      const wanted = [0, 0, 0];
      viridis((sigma - low) / (high - low), wanted);
      return { wanted, found: found[i]! };
    });
    const [least, most] = seen;
    const wrong = seen.filter(({ wanted, found }) => gap(wanted, found) >= 24);
    if (gap(least!.wanted, most!.wanted) <= 48) return "all colours alike";
    return wrong.map(({ wanted, found }) => `${found} for ${wanted}`).join("; ");
  };

  it("is coloured by sigma", async () => {
    let said = await miscoloured();
    for (let look = 0; look < 20 && said; look++) {
      await page.waitForTimeout(250);
      said = await miscoloured();
    }
    assert.equal(said, "");
  });

  /** Of each place whether it has the colour of its sigma, with nothing over it. */
  const plain = async (grid: SigmaGrid, places: readonly Bare[]): Promise<boolean[]> => {
    const [low, high] = extent(grid);
    const found = await colours(places.map(({ at: spot }) => spot));
    return places.map(({ sigma }, i) => {
      const wanted = [0, 0, 0];
      viridis((sigma - low) / (high - low), wanted);
      return gap(wanted, found[i]!) < 24;
    });
  };

  it("hatches what nothing like was captured, in gaps too, in light and in dark", async () => {
    const { grid, points } = await bare();
    const gaps = points.filter(({ supported, inside }) => inside && !supported);
    const beyond = points.filter(({ supported, inside }) => supported && !inside);
    assert.ok(gaps.length > 2 && beyond.length > 2, `${gaps.length} and ${beyond.length}`);
    for (const scheme of ["light", "dark"] as const) {
      await page.emulateMedia({ colorScheme: scheme });
      await page.waitForTimeout(300);
      const bare = await plain(grid, points);
      const wrong = points.filter(({ supported }, i) => bare[i] !== supported);
      assert.deepEqual(wrong, [], scheme);
    }
    await page.emulateMedia({ colorScheme: null });
    const said = await page.locator(".map-legend").innerText();
    assert.match(said, /Hatched: nothing like it was captured/);
    const share = grid.supported!.flat().filter(Boolean).length / grid.supported!.flat().length;
    const words = await page.locator(".map-words").innerText();
    assert.equal(Number(words.match(/captured, (\d+) % of this map/)![1]), Math.round(100 * share));
  });

  it("keeps the focus where its axes are chosen by keys", async () => {
    const across = page.locator(".map").getByLabel("across", { exact: true });
    await across.focus();
    const before = await across.inputValue();
    await page.keyboard.press("ArrowUp");
    assert.notEqual(await across.inputValue(), before);
    assert.ok(await across.evaluate((field) => field === document.activeElement));
    await page.keyboard.press("ArrowDown");
    assert.equal(await across.inputValue(), before);
    await page.locator(".map").getByLabel("up", { exact: true }).selectOption("target_height");
    await settled(page, "turn, rows: target_height");
  });

  it("says aloud where one is once that rests", async () => {
    await page.locator(".map-canvas").focus();
    const said = page.locator(".map [aria-live]");
    const before = await said.innerText();
    for (let i = 0; i < 5; i++) await page.keyboard.press("ArrowRight");
    assert.equal(await said.innerText(), before);
    const now = await page.locator(".map-here").innerText();
    await page.waitForFunction(
      (text) => document.querySelector(".map [aria-live]")!.textContent === text,
      now,
    );
    assert.equal(await page.locator(".map output").count(), 0);
  });

  it("shows the answer to the later question where the earlier fails", async () => {
    const other = await opened(
      from,
      "/#reaching?turn=20&target_height=1&~across=turn&~along=target_height&~playing=no",
    );
    const words = other.page.locator(".map-words", { hasText: "Within" });
    await words.waitFor();
    const before = await words.innerText();
    let asked = 0;
    await other.page.route(/sigma/, async (route) => {
      asked += 1;
      if (asked > 1) return route.continue();
      await new Promise((done) => setTimeout(done, 1000));
      return route.abort();
    });
    const hips = other.page.locator('[data-control="hip_height"] input[type=range]');
    await hips.fill("100");
    await until(async () => asked === 1, "it is asked");
    await hips.fill("900");
    await until(async () => (await words.innerText()) !== before, "the later answer is shown");
    await other.page.close();
  });

  it("goes to a clip as who moved it", async () => {
    const walkers = await client.card("cmu_walk");
    const other = await opened(from, "/#cmu_walk?~playing=no");
    await other.page.locator(".map-words", { hasText: "Within" }).waitFor();
    await other.page.locator(".map-canvas").focus();
    await other.page.keyboard.press("PageDown");
    const said = await other.page.locator(".map-here").innerText();
    const index = walkers.sources.indexOf(said.match(/example (.*), exactly$/)![1]!);
    const who = walkers.performers[walkers.moved_by[index]!]!;
    assert.ok(who);
    assert.equal(await other.page.getByLabel("Performer").inputValue(), who);
    await other.page.close();
  });

  it("is drawn anew where other controls change", async () => {
    await page.locator(".map-canvas").focus();
    await page.keyboard.press("Home");
    const before = await page.locator(".map-words").innerText();
    for (let i = 0; i < 10; i++) await page.keyboard.press("PageDown");
    await page.waitForFunction(
      (text) => document.querySelector(".map-words")!.textContent !== text,
      before,
    );
  });

  it("has a table for who does not see it, and exchanges its axes", async () => {
    await page.getByText("Sigma as a table").click();
    assert.equal(await page.locator(".map tbody tr").count(), 6);
    assert.match(await page.locator(".map caption").innerText(), /\* nothing like it was captured/);
    const stars = await page.locator(".map tbody td", { hasText: "*" }).count();
    const grid = await client.sigma("reaching", {
      across: "turn",
      along: "target_height",
      columns: 48,
      rows: 36,
      margin: MARGIN,
      controls: await others(),
    });
    const pick = (count: number) =>
      [0, 1, 2, 3, 4, 5].map((i) => Math.round((i * (count - 1)) / 5));
    const lacking = pick(36).flatMap((row) => pick(48).filter((i) => !grid.supported![row]![i]));
    assert.equal(stars, lacking.length);
    assert.ok(stars > 0 && stars < 36, `${stars}`);
    await page.locator(".map").getByLabel("across", { exact: true }).selectOption("target_height");
    await settled(page, "target_height");
    assert.equal(await page.locator(".map").getByLabel("up", { exact: true }).inputValue(), "turn");
    assert.match(
      await page.locator(".map caption").innerText(),
      /Columns: target_height, rows: turn/,
    );
  });

  it("and nothing went wrong unnoticed", () => assert.deepEqual(faults, []));
});

async function settled(page: Page, across: string): Promise<void> {
  await page
    .locator(".map caption", { hasText: `Columns: ${across}` })
    .waitFor({ state: "attached" });
}
