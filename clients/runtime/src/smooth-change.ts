/**
 * The smoothest change of a path that stands: one system of five diagonals.
 *
 * A path y minimises the sum of |y - f|² + (tau r)⁴ |D² (y - f)|² and is constant in each stance. f
 * is the predicted path, r the rate and D² the second difference. A cycle is cut in its first
 * stance, whose place is the only unknown that both ends of the chain share.
 */

import { PATH_SPREAD } from "./constants.ts";
import { type Grid, place, type Run } from "./stances.ts";
import { type Complex, conj, times } from "./vectors.ts";

type Bands = readonly [Float64Array, Float64Array, Float64Array];

/** Frames of a path, in order, of which frames of one stance share an unknown. */
interface Chain {
  readonly first: number;
  /** Unknown of each frame. */
  readonly unknowns: readonly number[];
  readonly size: number;
  readonly bands: Bands;
  /** Frames that count: those of one cycle. */
  readonly count: number;
  readonly stiffness: number;
}

/** Places of smoothest change over the floor, constant in stances. */
export function smoothPlaces(
  grid: Grid,
  path: readonly Complex[],
  stances: readonly Run[],
): readonly Complex[] {
  if (!stances.length) return path;
  const chain = chainOf(grid, stances);
  const target = chain.unknowns.map((_, frame) => place(grid, path, chain.first + frame));
  const goals = [0, 1].map((part) => goal(chain, target, part as 0 | 1));
  const [real, imaginary] = grid.cyclic
    ? joined(grid, chain, goals)
    : goals.map((sides) => solve(chain, sides, new Map()));
  const places = new Array<Complex>(grid.count);
  for (let frame = 0; frame < grid.count; frame++) {
    const unknown = chain.unknowns[frame]!;
    const value: Complex = [real![unknown]!, imaginary![unknown]!];
    const later = chain.first + frame >= grid.count;
    const back: Complex = [value[0] - grid.way[0], value[1] - grid.way[1]];
    places[(chain.first + frame) % grid.count] = later ? times(conj(grid.factor), back) : value;
  }
  return places;
}

/** Heights of smoothest change, with one given height in all stances. */
export function smoothHeights(
  grid: Grid,
  path: readonly number[],
  stances: readonly Run[],
  height: number,
): readonly number[] {
  if (!stances.length) return path;
  const chain = chainOf(grid, stances);
  const target = chain.unknowns.map(
    (_, frame): Complex => [path[(chain.first + frame) % grid.count]!, 0],
  );
  const standing = stances.map(({ begin }) => mod(begin - chain.first, grid.count));
  const fixed = new Map(standing.map((frame) => [chain.unknowns[frame]!, height]));
  if (grid.cyclic) fixed.set(chain.size - 1, height);
  const solution = solve(chain, goal(chain, target, 0), fixed);
  const heights = new Array<number>(grid.count);
  for (let frame = 0; frame < grid.count; frame++)
    heights[(chain.first + frame) % grid.count] = solution[chain.unknowns[frame]!]!;
  return heights;
}

function chainOf(grid: Grid, stances: readonly Run[]): Chain {
  const { count, cyclic } = grid;
  const first = cyclic ? stances[0]!.begin : 0;
  const length = count + 2 * Number(cyclic);
  const fresh = new Array<boolean>(length).fill(true);
  for (const { begin, end } of stances)
    for (let frame = begin + 1; frame < end; frame++) fresh[mod(frame - first, count)] = false;
  if (cyclic) fresh[length - 1] = false;
  const unknowns: number[] = [];
  let unknown = -1;
  for (const isFresh of fresh) {
    unknown += Number(isFresh);
    unknowns.push(unknown);
  }
  const size = unknown + 1;
  const stiffness = (PATH_SPREAD * grid.rate) ** 4;
  const chain = { first, unknowns, size, count, stiffness };
  return { ...chain, bands: bandsOf(chain) };
}

/** Diagonals of the matrix; unknowns are in the order of their frames. */
function bandsOf(chain: Omit<Chain, "bands">): Bands {
  const { unknowns, size, count, stiffness } = chain;
  const bands: Bands = [0, 1, 2].map(() => new Float64Array(size)) as unknown as Bands;
  for (let frame = 0; frame < count; frame++) bands[0][unknowns[frame]!]! += 1;
  const bends = [1, -2, 1];
  for (let middle = 1; middle < unknowns.length - 1; middle++) {
    for (let row = 0; row < 3; row++) {
      for (let column = row; column < 3; column++) {
        const at = unknowns[middle - 1 + row]!;
        const away = unknowns[middle - 1 + column]! - at;
        // A product off the diagonal of the frames counts twice on that of a stance.
        const share = away === 0 && row !== column ? 2 : 1;
        bands[away as 0 | 1 | 2][at]! += stiffness * share * bends[row]! * bends[column]!;
      }
    }
  }
  return bands;
}

/** Right sides of the equations, for one part of complex targets. */
function goal(chain: Chain, target: readonly Complex[], part: 0 | 1): Float64Array {
  const { unknowns, size, count, stiffness } = chain;
  const sides = new Float64Array(size);
  for (let frame = 0; frame < unknowns.length; frame++) {
    const value = target[frame]![part];
    if (frame < count) sides[unknowns[frame]!]! += value;
    if (frame === 0 || frame === unknowns.length - 1) continue;
    const bent = stiffness * (target[frame - 1]![part] - 2 * value + target[frame + 1]![part]);
    sides[unknowns[frame]!]! -= 2 * bent;
    sides[unknowns[frame - 1]!]! += bent;
    sides[unknowns[frame + 1]!]! += bent;
  }
  return sides;
}

/** Solutions of both parts for a cycle, with the first place that fits both ends. */
function joined(
  grid: Grid,
  chain: Chain,
  goals: readonly Float64Array[],
): [Float64Array, Float64Array] {
  const last = chain.size - 1;
  const zero = new Float64Array(chain.size);
  const ends = (begin: number, end: number) =>
    new Map([
      [0, begin],
      [last, end],
    ]);
  const columns = [
    solve(chain, goals[0]!, ends(0, grid.way[0])),
    solve(chain, goals[1]!, ends(0, grid.way[1])),
    solve(chain, zero, ends(1, 0)),
    solve(chain, zero, ends(0, 1)),
  ];
  const left = columns.map((column, index) => {
    const products = product(chain.bands, column);
    const sides = goals[index] ?? zero;
    return [products[0]! - sides[0]!, products[last]! - sides[last]!] as const;
  });
  const [begin, end] = ([0, 1] as const).map((row) => left.map((column) => column[row]));
  const [turned, back] = [grid.factor, conj(grid.factor)];
  const plain = sum([begin![0]!, begin![1]!], times(back, [end![0]!, end![1]!]));
  const bent = sum(
    sum([begin![2]!, 0], times(turned, [begin![3]!, 0])),
    times(back, sum([end![2]!, 0], times(turned, [end![3]!, 0]))),
  );
  const size = bent[0] ** 2 + bent[1] ** 2;
  const shared = times([-plain[0], -plain[1]], [bent[0] / size, -bent[1] / size]);
  const after = times(shared, turned);
  const parts = ([0, 1] as const).map((part) =>
    columns[part]!.map(
      (value, row) => value + shared[part] * columns[2]![row]! + after[part] * columns[3]![row]!,
    ),
  );
  return [parts[0]!, parts[1]!];
}

/** The solution of the system, with given values of fixed unknowns. */
function solve(
  { bands, size }: Chain,
  sides: Float64Array,
  fixed: ReadonlyMap<number, number>,
): Float64Array {
  const known = new Float64Array(size);
  for (const [unknown, value] of fixed) known[unknown] = value;
  const right = product(bands, known).map((value, row) => sides[row]! - value);
  const [diagonal, near, far] = bands.map((band) => band.slice()) as unknown as Bands;
  for (const [unknown, value] of fixed) {
    [diagonal[unknown], near[unknown], far[unknown]] = [1, 0, 0];
    if (unknown > 0) near[unknown - 1] = 0;
    if (unknown > 1) far[unknown - 2] = 0;
    right[unknown] = value;
  }
  // L D Lᵀ, in place: the bands become D and the two diagonals of L.
  for (let row = 0; row < size; row++) {
    const [one, two] = [diagonal[row - 1] ?? 1, diagonal[row - 2] ?? 1];
    const outer = row > 1 ? far[row - 2]! / two : 0;
    const inner =
      row > 0 ? (near[row - 1]! - (row > 1 ? outer * two * near[row - 2]! : 0)) / one : 0;
    diagonal[row]! -= inner ** 2 * one + outer ** 2 * two;
    if (row > 0) near[row - 1] = inner;
    if (row > 1) far[row - 2] = outer;
    right[row]! -= inner * (right[row - 1] ?? 0) + outer * (right[row - 2] ?? 0);
  }
  for (let row = 0; row < size; row++) right[row]! /= diagonal[row]!;
  for (let row = size - 1; row >= 0; row--)
    right[row]! -=
      (near[row] ?? 0) * (right[row + 1] ?? 0) + (far[row] ?? 0) * (right[row + 2] ?? 0);
  return right;
}

function product(bands: Bands, values: Float64Array): Float64Array {
  const products = values.map((value, row) => bands[0][row]! * value);
  for (const offset of [1, 2] as const)
    for (let row = 0; row + offset < values.length; row++) {
      products[row]! += bands[offset][row]! * values[row + offset]!;
      products[row + offset]! += bands[offset][row]! * values[row]!;
    }
  return products;
}

function sum(a: Complex, b: Complex): Complex {
  return [a[0] + b[0], a[1] + b[1]];
}

function mod(value: number, count: number): number {
  return ((value % count) + count) % count;
}
