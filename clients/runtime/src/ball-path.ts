/** Paths of the joints that contact: the smoothest changes of predicted paths, with lifted swings. */

import {
  FULL_STEP,
  LEAST_LIFT,
  LIFT_ACCELERATION,
  LIFT_EXPONENT,
  LIFT_SHARE,
  RISE,
} from "./constants.ts";
import { roll } from "./rolling.ts";
import { smoothHeights, smoothPlaces } from "./smooth-change.ts";
import { distance, type Foot, framesOf, isInner, mask, type Run, runs } from "./stances.ts";
import { type Complex, roundEven, type Vector } from "./vectors.ts";

/** The path of a foot that stands in stances, and rolls there. */
export function planPath(foot: Foot, stances: readonly Run[]): Vector[] {
  const { grid, contact } = foot;
  const rolled = roll(foot, stances);
  // A foot that rolls keeps its place but for the offset of its ball.
  const flat = foot.floor.map(
    ([z, x], frame): Complex => [z - rolled.floor[frame]![0], x - rolled.floor[frame]![1]],
  );
  const floor = smoothPlaces(grid, flat, stances).map(
    ([z, x], frame): Complex => [z + rolled.floor[frame]![0], x + rolled.floor[frame]![1]],
  );
  const level = foot.heights.map((height, frame) => height - rolled.heights[frame]!);
  const heights = smoothHeights(grid, level, stances, contact.height).map(
    (height, frame) => rolled.heights[frame]! + height,
  );
  const { added, lowest } = lifts(foot, floor, heights, stances);
  return floor.map(([z, x], frame): Vector => {
    const least = contact.height + lowest[frame]! + Math.min(rolled.heights[frame]!, 0);
    return [x, Math.max(heights[frame]! + added[frame]!, least), z];
  });
}

/** Lift of a swinging foot, m, and its least heights in swings. */
function lifts(
  foot: Foot,
  floor: readonly Complex[],
  heights: readonly number[],
  stances: readonly Run[],
): { added: number[]; lowest: number[] } {
  const { grid, contact } = foot;
  const [added, lowest] = [0, 1].map(() => new Array<number>(grid.count).fill(0));
  const swinging = mask(stances, grid).map((standing) => !standing);
  for (const swing of runs(swinging, grid.cyclic)) {
    const length = swing.end - swing.begin;
    // Those with a stance before or after them.
    if (length >= grid.count) continue;
    const inner = isInner(swing, grid);
    const step = distance(grid, floor, ...stancesBeside(swing, foot));
    let smallest = LIFT_SHARE * contact.clearance * Math.min(step / FULL_STEP, 1);
    // A parabola: how high a foot is lifted at most in the duration of its swing.
    if (inner) smallest = Math.min(smallest, (LIFT_ACCELERATION * (length / grid.rate) ** 2) / 8);
    // A swing at an end of a clip goes on outside it, for the usual duration.
    const usual = inner ? length : Math.max(length, roundEven(contact.swing * grid.rate));
    const lead = swing.begin === 0 && !inner ? usual - length : 0;
    const frames = framesOf(swing);
    const rises = frames.map((_, index) =>
      liftShare((index + 1 + lead) / (usual + 1), (usual + 1) / grid.rate),
    );
    const most = frames.reduce((top, at) => Math.max(top, heights[at % grid.count]!), -Infinity);
    const lifted = Math.max(most - contact.height, 0);
    const extra = Math.max(smallest * Math.max(...rises) - lifted, 0);
    for (const [index, frame] of frames.entries()) {
      added![frame % grid.count] = extra * rises[index]!;
      lowest![frame % grid.count] = Math.min(smallest, LEAST_LIFT) * rises[index]!;
    }
  }
  return { added: added!, lowest: lowest! };
}

/** Frames in which a foot stands before and after a swing, or the ends of the clip. */
function stancesBeside({ begin, end }: Run, { grid }: Foot): [number, number] {
  const after = grid.cyclic && begin === 0 ? grid.count : 0;
  if (grid.cyclic) return [begin - 1 + after, end + after];
  return [Math.max(begin - 1, 0), Math.min(end, grid.count - 1)];
}

/** The share of a lift at a share of a swing, which begins and ends at rest. */
function liftShare(share: number, seconds: number): number {
  const quickest = Math.max(seconds / RISE, 2);
  const soon = Math.min(Math.min(share, 1 - share) * quickest, 1);
  return Math.sin(Math.PI * share) ** LIFT_EXPONENT * soon ** 2 * (3 - 2 * soon);
}
