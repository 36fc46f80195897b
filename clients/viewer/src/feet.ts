/** Where feet stand, drawn on the ground, and how fast they slide meanwhile. */

import type { ModelCard, Motion } from "@posefield/client";
import { Group, Mesh, MeshBasicMaterial, RingGeometry } from "three";

import * as contacts from "./contacts.ts";
import { el } from "./dom.ts";
import { step } from "./playback.ts";
import type { Session } from "./session.ts";
import { place, placed } from "./skeleton.ts";
import type { State } from "./state.ts";
import { floorOf } from "./takes.ts";
import * as theme from "./theme.ts";

export function mount(host: HTMLElement, session: Session): void {
  const { player, scene, signal, store } = session;
  const feet = joints(session.card);
  const marks = new Marks();
  const meter = el("strong", { "data-skate": "" });
  const about = el("p", { class: "about" });
  host.append(el("div", { class: "title" }, el("h2", {}, "Feet"), el("span", {}, meter)), about);
  scene.root.add(marks.group);
  /** What the clip that is there was asked as; where that has changed, another is on its way. */
  let answered: State["root"] | null = null;
  const judge = () => {
    const { feet: wanted, root, view } = store.state;
    const clip = player.clip;
    host.hidden = !wanted;
    marks.group.visible = wanted && view === "one" && root === session.card.root;
    const why = unjudged(feet, session);
    about.textContent = why ?? HOW;
    meter.textContent = why ? "" : "…";
    if (!clip || why || answered !== root) return marks.of(null);
    const tracks = trodden(session.card, clip, feet);
    const found = contacts.ground(tracks, 1 / step(clip));
    meter.textContent = `${(100 * found.slide).toFixed(1)} cm/s`;
    marks.of(found);
  };
  const press = () => {
    const { clip, shown } = player;
    if (!clip || !marks.group.visible) return;
    marks.group.position.set(
      shown.carried.x,
      floorOf(session.source, session.card, store.state),
      shown.carried.z,
    );
    marks.group.rotation.y = shown.carried.turn;
    marks.press(Math.round(store.state.time / step(clip)));
  };
  judge();
  player.onClip(() => {
    answered = store.state.root;
    judge();
  });
  player.watch(press);
  theme.listen(() => marks.tint(), signal);
  const leave = store.listen((_, changed) => {
    if (!["feet", "root", "view"].some((key) => changed.has(key as "feet"))) return;
    judge();
    press();
    scene.redraw();
  });
  signal.addEventListener("abort", () => {
    leave();
    marks.dispose();
  });
}

const HOW = `Mean speed along the ground while a foot is within ${100 * contacts.PLANTED} cm of its lowest, as the service reckons it. Rings: where each foot stands; filled while it does.`;

/** In words, why nothing can be said; null where it can. */
function unjudged(feet: readonly number[], { card, store }: Session): string | null {
  if (!feet.length) return "This model does not say which joints are feet.";
  if (store.state.root !== card.root)
    return "In place, every foot slides: switch root motion on to judge them.";
  return null;
}

/** The joints that stand on the ground, by the recipe or by their parts. */
function joints({ feet, roles, skeleton }: ModelCard): readonly number[] {
  if (feet.length) return feet;
  const named = ["leftToes", "rightToes"].map((part) => skeleton.names.indexOf(roles[part] ?? ""));
  return named.filter((joint) => joint >= 0);
}

/** Of each foot its way through the clip, F × 3, m. */
function trodden(card: ModelCard, clip: Motion, feet: readonly number[]): Float32Array[] {
  const { parents } = card.skeleton;
  const at = placed(parents.length);
  const frames = clip.times.length;
  const tracks = feet.map(() => new Float32Array(3 * frames));
  for (let frame = 0; frame < frames; frame++) {
    place(at, parents, clip.boneOffsets, clip.rotations, clip.rootPosition, frame);
    feet.forEach((joint, foot) => {
      tracks[foot]!.set(at.positions.subarray(3 * joint, 3 * joint + 3), 3 * frame);
    });
  }
  return tracks;
}

const RING = new RingGeometry(0.052, 0.064, 40).rotateX(-Math.PI / 2);
const DISC = new RingGeometry(0, 0.046, 40).rotateX(-Math.PI / 2);

class Marks {
  readonly group = new Group();
  readonly #material = new MeshBasicMaterial({ transparent: true, opacity: 0.9 });
  #found: contacts.Ground | null = null;

  constructor() {
    this.tint();
  }

  /** A ring with a disc in it for each contact. */
  of(found: contacts.Ground | null): void {
    this.#found = found;
    const rings = (found?.contacts ?? []).map(({ x, z }) => {
      const ring = new Mesh(RING, this.#material);
      ring.position.set(x, 0.004, z);
      ring.add(new Mesh(DISC, this.#material));
      return ring;
    });
    this.group.clear();
    if (rings.length) this.group.add(...rings);
  }

  /** Fills those where a foot stands now. */
  press(frame: number): void {
    this.#found?.contacts.forEach(({ first, last }, i) => {
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
