/** Inverse kinematics of a leg of two bones, in closed form. */

import {
  FOLDED,
  HINGE_FREE,
  LEAST_ACROSS,
  LEAST_BEND,
  OVERSTRETCHED,
  PRESS,
  REACH,
  SOFTNESS,
  STRAIGHT,
} from "./constants.ts";
import type { HingeLimits } from "./hinge.ts";
import type { Limb, LimbPoses } from "./limbs.ts";
import {
  add,
  clamp,
  conjugate,
  cross,
  dot,
  multiply,
  norm,
  type Quaternion,
  rotate,
  scale,
  shortestTurn,
  subtract,
  unit,
  type Vector,
  ZERO,
} from "./vectors.ts";

/** Local rotations of the three joints of a limb. */
export interface LimbTurns {
  readonly upper: Quaternion;
  readonly middle: Quaternion;
  readonly lower: Quaternion;
}

/** Smallest and largest distance of a limb's ends, m, within the range of its hinge. */
export function distances(poses: LimbPoses, limb: Limb): [number, number] {
  const [above, below] = [poses.length(limb.middle), poses.length(limb.lower)];
  if (!limb.hinge) return [Math.abs(above - below), above + below];
  const [squares, products] = [above ** 2 + below ** 2, 2 * above * below];
  const bends = [limb.hinge.high[0] + HINGE_FREE, limb.hinge.low[0] - HINGE_FREE];
  const [shortest, longest] = bends.map((bend) =>
    Math.sqrt(squares + Math.cos(clamp(bend, 0, Math.PI)) * products),
  );
  return [shortest!, longest!];
}

/** Distance, m, up to which the end of a limb follows its target exactly. */
export function firmReach(poses: LimbPoses, limb: Limb, frame: number): number {
  const length = distances(poses, limb)[1];
  return Math.max(norm(poses.between(limb.upper, limb.lower, frame)), REACH * length - SOFTNESS);
}

/** Distance, m, that a leg spans where it is wanted to span some. */
export function legChord(poses: LimbPoses, leg: Limb, frame: number, distance: number): number {
  const [shortest, longest] = distances(poses, leg);
  let chord: number;
  if (leg.tip === leg.lower) {
    const firm = firmReach(poses, leg, frame);
    const soft = Math.max(Math.max(REACH * longest, firm) - firm, 1e-9);
    const beyond = Math.max(distance - firm, 0);
    chord = Math.min(distance, firm - soft * Math.expm1(-beyond / soft));
  } else {
    const source = norm(poses.between(leg.upper, leg.lower, frame));
    const more = distance - source;
    const room = Math.max(STRAIGHT * longest - source, 1e-4);
    chord = source + more / Math.sqrt(1 + (Math.max(more, 0) / room) ** 2);
    const press = PRESS / (1 + (room / PRESS) ** 2);
    chord += press * Math.tanh(Math.max(-more, 0) / press);
  }
  return Math.max(chord, 1.001 * shortest + 1e-6);
}

/** The mean bend of a limb over poses, about an axis of its upper bone. */
export function meanBend(poses: LimbPoses, limb: Limb): Vector {
  let sum = ZERO;
  for (let frame = 0; frame < poses.frames; frame++) {
    const chord = unit(poses.between(limb.upper, limb.lower, frame), 1e-9);
    const normal = cross(poses.between(limb.upper, limb.middle, frame), chord);
    sum = add(sum, rotate(conjugate(poses.orientation(limb.upper, frame)), normal));
  }
  return scale(sum, 1 / poses.frames);
}

/**
 * Rotations with which the end of a limb comes where it is wanted; the end keeps its orientation.
 *
 * end: from the limb's upper joint, m. mean: of `meanBend`, for a limb without hinge.
 */
export function solve(
  poses: LimbPoses,
  limb: Limb,
  frame: number,
  end: Vector,
  mean: Vector,
): LimbTurns {
  const parent = conjugate(poses.parentOrientation(limb.upper, frame));
  const lower = poses.orientation(limb.lower, frame);
  const [thigh, shin] = limb.hinge
    ? hinged(poses, limb, limb.hinge, frame, end)
    : free(poses, limb, frame, end, mean);
  return {
    upper: multiply(parent, thigh),
    middle: multiply(conjugate(thigh), shin),
    lower: multiply(conjugate(shin), lower),
  };
}

/** The middle joint bends to the distance, and the limb turns by the smallest rotation. */
function hinged(
  poses: LimbPoses,
  limb: Limb,
  hinge: HingeLimits,
  frame: number,
  end: Vector,
): [Quaternion, Quaternion] {
  const upper = poses.orientation(limb.upper, frame);
  const inner = poses.orientation(limb.middle, frame);
  const above = rotate(conjugate(upper), poses.between(limb.upper, limb.middle, frame));
  const below = rotate(conjugate(inner), poses.between(limb.middle, limb.lower, frame));
  const bent = hinge.bend(multiply(conjugate(upper), inner), above, below, dot(end, end));
  const towards = rotate(upper, add(above, rotate(bent, below)));
  const thigh = multiply(shortestTurn(towards, end), upper);
  return [thigh, multiply(thigh, bent)];
}

/** Both bones turn by the shortest rotations, in the plane in which the limb bent before. */
function free(
  poses: LimbPoses,
  limb: Limb,
  frame: number,
  end: Vector,
  mean: Vector,
): [Quaternion, Quaternion] {
  const [above, below] = [poses.length(limb.middle), poses.length(limb.lower)];
  const distance = norm(end);
  const towards = scale(end, 1 / distance);
  const side = bendDirection(poses, limb, frame, towards, mean);
  const along = (above ** 2 + distance ** 2 - below ** 2) / (2 * distance);
  const across = Math.sqrt(Math.max(above ** 2 - along ** 2, 0));
  const knee = add(scale(towards, along), scale(side, across));
  const upper = poses.between(limb.upper, limb.middle, frame);
  const lower = poses.between(limb.middle, limb.lower, frame);
  return [
    multiply(shortestTurn(upper, knee), poses.orientation(limb.upper, frame)),
    multiply(shortestTurn(lower, subtract(end, knee)), poses.orientation(limb.middle, frame)),
  ];
}

/** The unit vector, orthogonal to the limb, towards which its middle bends. */
function bendDirection(
  poses: LimbPoses,
  limb: Limb,
  frame: number,
  towards: Vector,
  mean: Vector,
): Vector {
  const chord = poses.between(limb.upper, limb.lower, frame);
  const old = unit(chord, 1e-9);
  const bone = poses.between(limb.upper, limb.middle, frame);
  const bend = across(bone, old);
  const length = poses.length(limb.middle);
  const axis = rotate(poses.orientation(limb.upper, frame), unit(mean, 1e-9));
  const meanSide = cross(old, axis);
  let bent = norm(bend);
  if (limb.tip !== limb.lower) {
    // A knee that is a little overstretched would bend backwards where its leg is shortened.
    const little = clamp(2 - bent / (OVERSTRETCHED * length), 0, 1);
    bent += little * (dot(bend, meanSide) - bent);
  }
  const mixed = add(bend, scale(meanSide, Math.max(LEAST_BEND * length - bent, 0)));
  let side = rotate(shortestTurn(old, towards), mixed);
  // The middle of a folded limb moves as the limb does.
  const size = norm(bone);
  const sideways = scale(across(bone, towards), 1 / size);
  const much = norm(sideways);
  const folded = clamp(2 - norm(chord) / (2 * FOLDED * size), 0, 1);
  const share = folded * clamp(much / LEAST_ACROSS, 0, 1);
  const middle = scale(sideways, norm(side) / Math.max(much, 1e-9));
  side = add(side, scale(subtract(middle, side), share));
  return unit(across(side, towards));
}

/** The part of a vector that is orthogonal to a unit vector. */
function across(vector: Vector, axis: Vector): Vector {
  return subtract(vector, scale(axis, dot(vector, axis)));
}
