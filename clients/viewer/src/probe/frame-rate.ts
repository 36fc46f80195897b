/** Frame rate of animations: even keys are frames, as in training. */

import { Refusal } from "./motion.ts";
import { general } from "./numbers.ts";

const BROADCAST_RATES = [24, 30, 60, 120].map((base) => (1000 * base) / 1001);
const RATE_TOLERANCE = 1e-4;
const LEAST_RATE = 10;
const EVEN = 0.02;
const DROPPED = 0.1;
const WAY_OUT = "expected a key in every frame, or source.rate, at which the curves are sampled";

/** Frames a second: the nearest whole or broadcast rate, else the inverse of the frame time. */
export function snappedRate(frameTime: number): number {
  const rate = 1 / frameTime;
  const known = [Math.max(1, Math.round(rate)), ...BROADCAST_RATES];
  const apart = (each: number) => Math.abs(each - rate);
  const nearest = known.reduce((best, each) => (apart(each) < apart(best) ? each : best));
  return apart(nearest) <= RATE_TOLERANCE * nearest ? nearest : rate;
}

/** Frames a second of increasing times of keys, s. Throws a Refusal where keys are no frames. */
export function rateOfKeys(keys: Float64Array): number {
  const [first, last] = [keys[0] ?? 0, keys.at(-1) ?? 0];
  if (keys.length < 2 || !(last > first))
    throw new Refusal(`found ${keys.length} key, a pose without motion, expected two or more`);
  refuseUneven(keys);
  const found = snappedRate((last - first) / (keys.length - 1));
  if (found < LEAST_RATE)
    throw new Refusal(`found ${keys.length} keys at ${general(found, 6)} a second, ${WAY_OUT}`);
  return found;
}

function refuseUneven(keys: Float64Array): void {
  const spacing = keys.subarray(1).map((time, index) => time - keys[index]!);
  const sorted = spacing.toSorted();
  const middle = sorted.length >> 1;
  const step = sorted.length % 2 ? sorted[middle]! : (sorted[middle - 1]! + sorted[middle]!) / 2;
  if (spacing.every((each) => Math.abs(each - step) <= EVEN * step)) return;
  const frames = spacing.map((each) => Math.round(each / step));
  const lost = frames.reduce((sum, each) => sum + each - 1, 0);
  const whole = spacing.every(
    (each, at) => Math.abs(each - frames[at]! * step) <= EVEN * step * Math.max(frames[at]!, 1),
  );
  if (whole && frames.every((each) => each >= 1) && lost <= DROPPED * (keys.length + lost)) {
    const after = general(keys[frames.findIndex((each) => each > 1)]!, 6);
    throw new Refusal(
      `found ${lost} dropped frames of ${keys.length + lost} at ${general(1 / step, 6)} a second, the first after ${after} s, ${WAY_OUT}`,
    );
  }
  throw new Refusal(
    `found keys at uneven times, ${general(sorted[0]!, 4)} to ${general(sorted.at(-1)!, 4)} s apart, ${WAY_OUT}`,
  );
}
