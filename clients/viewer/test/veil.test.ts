/** The hatched region: the unsupported points, parted half-way from the supported ones. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { type Point, shape } from "../src/chart.ts";
import { noise } from "./noise.ts";

/** Twice the area of a polygon, by its corners. */
const doubled = (places: readonly Point[]): number =>
  places.reduce((sum, [x, y], i) => {
    const [right, up] = places[(i + 1) % places.length]!;
    return sum + x * up - right * y;
  }, 0);

const size = (supported: readonly (readonly boolean[])[]): number =>
  shape(supported).area.reduce((sum, places) => sum + doubled(places) / 2, 0);

test("all, nothing and half of a map", () => {
  const grid = (held: (column: number) => boolean) =>
    Array.from({ length: 3 }, () => [0, 1, 2, 3].map(held));
  assert.deepEqual(shape(grid(() => true)), { area: [], edges: [] });
  assert.equal(size(grid(() => false)), 6);
  assert.deepEqual(shape(grid(() => false)).edges, []);
  const half = shape(grid((column) => column < 2));
  assert.equal(size(grid((column) => column < 2)), 3);
  assert.ok(half.edges.flat().every(([x]) => x === 1.5));
  assert.equal(half.edges.length, 2);
});

test("a lone point is a diamond, whichever of the two it is", () => {
  const lone = (held: boolean) =>
    Array.from({ length: 3 }, (_, y) => [0, 1, 2].map((x) => (x === 1 && y === 1) === held));
  assert.equal(size(lone(false)), 0.5);
  assert.equal(size(lone(true)), 3.5);
  const lengths = shape(lone(true)).edges.map(([[a, b], [c, d]]) => Math.hypot(c - a, d - b));
  assert.deepEqual(lengths, Array(4).fill(Math.SQRT1_2));
});

test("the outline is closed but at the map's border, and parts what differs", () => {
  const [rows, columns] = [9, 11];
  const next = noise(1);
  const grid = Array.from({ length: rows }, () =>
    Array.from({ length: columns }, () => next() < 0.5),
  );
  const { edges } = shape(grid);
  const met = new Map<string, number>();
  for (const place of edges.flat()) met.set(String(place), (met.get(String(place)) ?? 0) + 1);
  for (const [place, times] of met) {
    const [x, y] = place.split(",").map(Number) as [number, number];
    const border = x === 0 || y === 0 || x === columns - 1 || y === rows - 1;
    assert.equal(times, border ? 1 : 2, place);
    assert.notEqual(grid[Math.floor(y)]![Math.floor(x)], grid[Math.ceil(y)]![Math.ceil(x)], place);
  }
  assert.ok(edges.length > 20);
  // Negative control: where one point is another, the outline is another.
  grid[4]![5] = !grid[4]![5];
  assert.notDeepEqual(shape(grid).edges, edges);
});
