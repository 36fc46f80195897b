/** Contacts of the feet with the ground: drawn on it, with the speed at which the feet slide.
 *
 * They are found as the service finds them (service/posefield/motion/foot_skate.py), of the clip that
 * is shown, so that feet as predicted have them too.
 */

import type { ModelCard, Motion } from "@posefield/client";
import { Group, Mesh, MeshBasicMaterial, RingGeometry } from "three";

import { el, titled } from "./dom.ts";
import { step } from "./playback.ts";
import type { Session } from "./player.ts";
import { floorOf } from "./questions.ts";
import { place, placed } from "./skeleton.ts";
import { has, type State } from "./state.ts";
import * as theme from "./theme.ts";

/** A foot within this of its lowest in the clip is on the ground, m. */
export const PLANTED = 0.02;

/** A contact of a foot: its first and last frame, and its mean position. */
export interface Contact {
  readonly foot: number;
  readonly first: number;
  readonly last: number;
  readonly x: number;
  readonly z: number;
}

interface Ground {
  readonly contacts: readonly Contact[];
  /** Mean horizontal speed while on the ground, m/s. */
  readonly slide: number;
}

/** Find the contacts. tracks: positions of each foot, F × 3, m. rate: frames a second. */
export function ground(tracks: readonly Float32Array[], rate: number): Ground {
  const contacts = tracks.flatMap((track, foot) => contactsOf(track, foot));
  let way = 0;
  let frames = 0;
  for (const { foot, first, last } of contacts) {
    for (let frame = first; frame < last; frame++) way += groundStep(tracks[foot]!, frame);
    frames += last - first;
  }
  return { contacts, slide: frames ? (way * rate) / frames : 0 };
}

function contactsOf(track: Float32Array, foot: number): Contact[] {
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

/** Return the distance along the ground to the next frame, m. */
function groundStep(track: Float32Array, frame: number): number {
  return Math.hypot(
    track[3 * frame + 3]! - track[3 * frame]!,
    track[3 * frame + 5]! - track[3 * frame + 2]!,
  );
}

export function mount(host: HTMLElement, session: Session): void {
  const { card, player, scene, signal, store } = session;
  const feet = joints(card);
  const marks = new Marks();
  const meter = el("strong", { "data-skate": "" });
  const about = el("p", { class: "about" });
  host.append(titled("Feet", el("span", {}, meter)), about);
  scene.root.add(marks.group);
  /** Root of the clip's question; while it differs from the state's, another clip is on its way. */
  let answered: State["root"] | null = null;
  const judge = () => {
    const { feet: wanted, root, view } = store.state;
    const clip = player.clip;
    host.hidden = !wanted;
    marks.group.visible = wanted && view === "one" && root === card.root;
    const why = !feet.length
      ? "This model does not say which joints are feet."
      : root !== card.root
        ? "In place, every foot slides: switch root motion on to judge them."
        : null;
    about.textContent = why ?? HOW;
    meter.textContent = why ? "" : "…";
    if (!clip || why || answered !== root) return marks.set([]);
    const { contacts, slide } = ground(tracks(card, clip, feet), 1 / step(clip));
    meter.textContent = `${(100 * slide).toFixed(1)} cm/s`;
    marks.set(contacts);
  };
  const press = () => {
    const { clip, shown } = player;
    if (!clip || !marks.group.visible) return;
    const { turn, x, z } = shown.carried;
    marks.group.position.set(x, floorOf(card, store.state), z);
    marks.group.rotation.y = turn;
    marks.fill(Math.round(store.state.time / step(clip)));
  };
  judge();
  player.onClip(() => {
    answered = store.state.root;
    judge();
  });
  player.watch(press);
  theme.listen(() => marks.tint(), signal);
  store.listen((_, changed) => {
    if (!has(changed, "feet", "root", "view")) return;
    judge();
    press();
    scene.redraw();
  }, signal);
  signal.addEventListener("abort", () => marks.dispose());
}

const HOW = `Mean speed along the ground while a foot is within ${100 * PLANTED} cm of its lowest, as the service reckons it. Rings: where each foot stands; filled while it does.`;

/** Return the joints that stand on the ground, by the recipe or by their roles. */
function joints({ feet, roles, skeleton }: ModelCard): readonly number[] {
  if (feet.length) return feet;
  const named = ["leftToes", "rightToes"].map((part) => skeleton.names.indexOf(roles[part] ?? ""));
  return named.filter((joint) => joint >= 0);
}

/** Return the positions of each foot through the clip, F × 3, m. */
function tracks(card: ModelCard, clip: Motion, feet: readonly number[]): Float32Array[] {
  const { parents } = card.skeleton;
  const at = placed(parents.length);
  const frames = clip.times.length;
  const found = feet.map(() => new Float32Array(3 * frames));
  for (let frame = 0; frame < frames; frame++) {
    place(at, parents, clip.boneOffsets, clip.rotations, clip.rootPosition, frame);
    feet.forEach((joint, foot) => {
      found[foot]!.set(at.positions.subarray(3 * joint, 3 * joint + 3), 3 * frame);
    });
  }
  return found;
}

const RING = new RingGeometry(0.052, 0.064, 40).rotateX(-Math.PI / 2);
const DISC = new RingGeometry(0, 0.046, 40).rotateX(-Math.PI / 2);

/** A ring for each contact, with a disc in it while the foot stands. */
class Marks {
  readonly group = new Group();
  readonly #material = new MeshBasicMaterial({ transparent: true, opacity: 0.9 });
  #contacts: readonly Contact[] = [];

  constructor() {
    this.tint();
  }

  set(contacts: readonly Contact[]): void {
    this.#contacts = contacts;
    this.group.clear();
    for (const { x, z } of contacts) {
      const ring = new Mesh(RING, this.#material);
      ring.position.set(x, 0.004, z);
      ring.add(new Mesh(DISC, this.#material));
      this.group.add(ring);
    }
  }

  fill(frame: number): void {
    this.#contacts.forEach(({ first, last }, i) => {
      this.group.children[i]!.children[0]!.visible = first <= frame && frame <= last;
    });
  }

  dispose(): void {
    this.group.removeFromParent();
    this.#material.dispose();
  }

  tint(): void {
    this.#material.color.set(theme.colour("--accent"));
  }
}
