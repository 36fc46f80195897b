/** Feet on the ground: when and where, and how fast they slide there.
 *
 * As the service reckons it (service/posefield/motion/foot_skate.py), of the clip that is shown: each foot's lowest
 * is that of this clip, at its frames.
 */

/** A foot within this of its lowest in the clip is on the ground, m. */
export const PLANTED = 0.02;

/** One foot's stay on the ground: frames, both counted in, and where it was on average. */
export interface Contact {
  readonly foot: number;
  readonly first: number;
  readonly last: number;
  readonly x: number;
  readonly z: number;
}

export interface Ground {
  readonly contacts: readonly Contact[];
  /** Mean horizontal speed while on the ground, m/s. */
  readonly slide: number;
}

/** tracks: of each foot, F × 3, m. rate: frames a second. */
export function ground(tracks: readonly Float32Array[], rate: number): Ground {
  const contacts = tracks.flatMap((track, foot) => stays(track, foot));
  let way = 0;
  let frames = 0;
  for (const { foot, first, last } of contacts) {
    for (let frame = first; frame < last; frame++) way += moved(tracks[foot]!, frame);
    frames += last - first;
  }
  return { contacts, slide: frames ? (way * rate) / frames : 0 };
}

function stays(track: Float32Array, foot: number): Contact[] {
  const frames = track.length / 3;
  let lowest = Infinity;
  for (let frame = 0; frame < frames; frame++) lowest = Math.min(lowest, track[3 * frame + 1]!);
  const found: Contact[] = [];
  for (let frame = 0, first = -1; frame <= frames; frame++) {
    const down = frame < frames && track[3 * frame + 1]! < lowest + PLANTED;
    if (down && first < 0) first = frame;
    if (!down && first >= 0) {
      if (frame - first > 1) found.push(contact(track, foot, first, frame - 1));
      first = -1;
    }
  }
  return found;
}

function contact(track: Float32Array, foot: number, first: number, last: number): Contact {
  let [x, z] = [0, 0];
  for (let frame = first; frame <= last; frame++) {
    x += track[3 * frame]!;
    z += track[3 * frame + 2]!;
  }
  const count = last - first + 1;
  return { foot, first, last, x: x / count, z: z / count };
}

/** From this frame to the next along the ground, m. */
function moved(track: Float32Array, frame: number): number {
  return Math.hypot(
    track[3 * frame + 3]! - track[3 * frame]!,
    track[3 * frame + 5]! - track[3 * frame + 2]!,
  );
}
