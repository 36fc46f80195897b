/** Interpolation in a grid, and the data of a copy. */

import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { gzipSync } from "node:zlib";
import * as door from "../src/offline/door.ts";
import { Refused } from "../src/offline/door.ts";
import { corners } from "../src/offline/grid.ts";
import { unpacked } from "../src/offline/read.ts";
import { CARD } from "./card.ts";

const AXES = [
  [0, 1, 4],
  [-1, 2],
];

/** Values of a function at the points of the grid, the last axis fastest. */
function tabulated(made: (x: number, y: number) => number): number[] {
  return AXES[0]!.flatMap((x) => AXES[1]!.map((y) => made(x, y)));
}

function interpolated(table: readonly number[], point: readonly number[]): number {
  return corners(AXES, point).reduce((sum, { index, weight }) => sum + weight * table[index]!, 0);
}

describe("interpolation in a grid", () => {
  const bilinear = (x: number, y: number) => 3 - 2 * x + 0.5 * y + 0.25 * x * y;

  it("is exact for polynomials of as many values as there are", () => {
    const table = tabulated(bilinear);
    for (const [x, y] of [
      [0, -1],
      [0.5, 0],
      [1, 2],
      [2.5, 1.7],
      [4, 2],
    ] as const) {
      assert.ok(Math.abs(interpolated(table, [x, y]) - bilinear(x, y)) < 1e-12, `${x} ${y}`);
    }
  });

  it("and only for that", () => {
    assert.ok(
      Math.abs(
        interpolated(
          tabulated((x) => x * x),
          [2.5, 0],
        ) - 6.25,
      ) < 1e-12,
    );
    const table = tabulated((x) => x ** 3);
    assert.equal(interpolated(table, [1, 0]), 1);
    assert.ok(Math.abs(interpolated(table, [2.5, 0]) - 2.5 ** 3) > 1);
  });

  it("takes a point of the grid as it is", () => {
    assert.deepEqual(corners(AXES, [1, 2]), [{ index: 3, weight: 1 }]);
    const weights = corners(AXES, [3, 0.5]).map(({ weight }) => weight);
    assert.equal(weights.length, 6);
    assert.ok(Math.abs(weights.reduce((sum, each) => sum + each, 0) - 1) < 1e-12);
  });
});

describe("the data of a copy", () => {
  it("are tables and columns of integers", async () => {
    const said = { word: "é", character: { offset: 2, size: 2 } };
    const head = Buffer.from(JSON.stringify(said));
    const size = Buffer.alloc(4);
    size.writeUInt32LE(head.length);
    // Two rows of two columns: 1, -2 and 300, -300.
    const columns = Buffer.from([1, 254, 44, 212, 0, 255, 1, 254]);
    const packed = gzipSync(Buffer.concat([size, head, Buffer.from([7]), columns]));
    const { tables, numbers, character } = await unpacked(packed.toString("base64"));
    assert.deepEqual(tables, said);
    assert.deepEqual([...character()], [254, 44]);
    const block = { offset: 1, rows: 2, columns: 2, steps: [0.5, 2] };
    assert.deepEqual([...numbers(block)], [0.5, 600, -1, -600]);
  });
});

describe("a question to a copy", () => {
  const axes = [
    [0.1, 0.5, 2, 2.4],
    [-30, -20, 20, 30],
  ];

  it("is answered within the table", () => {
    assert.deepEqual(door.point(CARD, axes, { speed: 2.4, time: -30 }), [2.4, -30]);
  });

  it("is refused outside of it, where nothing was computed", () => {
    for (const controls of [{ speed: 2.5, time: 0 }, { speed: 1, time: -31 }, { speed: 1 }]) {
      assert.throws(() => door.point(CARD, axes, controls), Refused);
    }
    assert.throws(
      () => door.point(CARD, axes, { speed: 2.5, time: 0 }),
      /expected 0.1 to 2.4 m\/s/,
    );
  });

  it("has a name of the set in the table, and says which others it leaves out", () => {
    const ann = door.names(CARD, "performer", { performer: "bob & co" });
    assert.deepEqual(ann, { who: 1, performer: "bob & co", labels: {}, left: [] });
    const calm = door.names(CARD, "style", { labels: { style: "calm", mood: "sad" } });
    assert.deepEqual([calm.who, calm.labels], [0, { style: "calm" }]);
    assert.deepEqual(calm.left, ["mood: sad was left out, this copy has no answers for it"]);
    assert.equal(
      door.names(CARD, "performer", { performer: null, labels: { style: null } }).who,
      -1,
    );
  });

  it("names one of each set", () => {
    const refused = (asked: door.Named, said: RegExp) =>
      assert.throws(() => door.names(CARD, "performer", asked), said);
    refused({ performer: "eve" }, /expected one of ann, bob & co/);
    refused({ labels: { hat: "red" } }, /no such label set/);
    refused({ performer: "ann", labels: { performer: "ann" } }, /expected once/);
    refused({ labels: { style: { calm: 0.5, "in a hurry": 0.5 } } }, /mixture of names .* service/);
  });
});
