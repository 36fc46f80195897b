/** All levels of detail side by side at the same moment, with the error of each as seen from here. */

import type { ClipQuestion, ModelCard, Motion } from "@posefield/client";
import { Color, Group, MeshStandardMaterial, type PerspectiveCamera, Vector3 } from "three";

import { farEnough, type Ladder, type Lens, ladder, lens, withLevel } from "./detail.ts";
import { el } from "./dom.ts";
import { SkinnedBody } from "./figure.ts";
import { Latest } from "./latest.ts";
import type { Session } from "./player.ts";
import { RATE, TAKE_AND_FEET, takeAndFeet } from "./questions.ts";
import { Joints } from "./skeleton.ts";
import { type Changes, has, type State } from "./state.ts";
import * as theme from "./theme.ts";
import { figure as digits, whole } from "./written.ts";

/** Seconds between two changes of the numbers. */
const READING = 0.15;
/** Share of its height by which the picture moves up, so that notes hide no feet. */
const RAISED = 0.12;

export function mount(host: HTMLElement, session: Session): void {
  new Levels(host, session);
}

class Levels {
  readonly #session: Session;
  readonly #host = el("section", {
    class: "levels",
    hidden: true,
    "aria-label": "Levels of detail",
  });
  readonly #group = new Group();
  readonly #ladder: Ladder;
  readonly #figures: readonly LevelFigure[];
  readonly #latest = new Latest<ClipQuestion>((question) => this.#fetch(question));
  #since = READING;

  constructor(host: HTMLElement, session: Session) {
    this.#session = session;
    const { card, scene, signal, store } = session;
    this.#ladder = ladder(card);
    this.#figures = card.levels.map((_, level) => new LevelFigure(session, level));
    for (const { body } of this.#figures) this.#group.add(body);
    this.#group.visible = false;
    this.#host.append(...this.#figures.map(({ note }) => note));
    scene.root.add(this.#group);
    host.append(this.#host);
    store.listen((state, changed) => this.#update(state, changed), signal);
    scene.add((seconds) => this.#step(seconds), signal);
    theme.listen(() => this.#tint(), signal);
    signal.addEventListener("abort", () => {
      if (this.#group.visible) scene.camera.clearViewOffset();
      this.#group.removeFromParent();
      for (const figure of this.#figures) figure.dispose();
    });
    this.#tint();
    this.#show(store.state);
  }

  #tint(): void {
    for (const figure of this.#figures) figure.tint();
    this.#session.scene.redraw();
  }

  #update(state: State, changed: Changes): void {
    if (has(changed, "controls", "performer", "labels", "root", "view", ...TAKE_AND_FEET))
      this.#show(state);
    if (changed.has("time") && this.#group.visible) this.#session.scene.redraw();
  }

  #show(state: State): void {
    const { card, scene } = this.#session;
    if (this.#group.visible && state.view !== "levels") scene.camera.clearViewOffset();
    this.#group.visible = state.view === "levels";
    this.#host.hidden = !this.#group.visible;
    scene.redraw();
    if (!this.#group.visible) return;
    // Characters that walk away would not stay side by side.
    const root = card.cyclic ? "in_place" : state.root;
    const { controls, labels, performer } = state;
    const rest = takeAndFeet(card, state);
    this.#latest.ask({ controls, performer, labels, root, fps: RATE, ...rest });
  }

  async #fetch(question: ClipQuestion): Promise<void> {
    const { service, store, signal, notice, scene } = this.#session;
    try {
      const motions = await Promise.all(
        this.#figures.map((_, level) =>
          service.client.clip(store.state.model, { ...question, level }, signal),
        ),
      );
      motions.forEach((motion, level) => {
        this.#figures[level]!.motion = motion;
      });
      scene.redraw();
    } catch (fault) {
      if (!signal.aborted) notice(fault);
    }
  }

  #step(seconds: number): boolean {
    if (!this.#group.visible || !this.#figures.every(({ motion }) => motion)) return false;
    const { playing, time } = this.#session.store.state;
    const { camera, orbit, renderer } = this.#session.scene;
    const { clientWidth, clientHeight } = renderer.domElement;
    const up = RAISED * clientHeight;
    camera.setViewOffset(clientWidth, clientHeight, 0, up, clientWidth, clientHeight);
    const aside = spacing(camera, orbit.target, this.#figures.length);
    const middle = (this.#figures.length - 1) / 2;
    for (const [level, figure] of this.#figures.entries()) {
      figure.place(time, aside.clone().multiplyScalar(level - middle));
    }
    this.#since += seconds;
    if (this.#since > READING || !playing) {
      this.#since = 0;
      camera.updateMatrixWorld();
      const seen = lens(camera.fov, renderer.domElement);
      for (const figure of this.#figures)
        figure.describe(camera, seen, this.#ladder, this.#figures[0]!.joints);
    }
    return playing;
  }
}

/** One level's character, and its note. */
class LevelFigure {
  readonly body: SkinnedBody;
  readonly joints: Joints;
  readonly note: HTMLElement;
  motion: Motion | null = null;
  readonly #level: number;
  readonly #material = new MeshStandardMaterial({ roughness: 0.75 });
  readonly #now = el("dd", { class: "levels-now" });
  readonly #from = el("dd");

  constructor({ card, character }: Session, level: number) {
    this.#level = level;
    this.body = new SkinnedBody(card, character, [this.#material]);
    // The light's shadows reach as far as one body.
    for (const skin of this.body.children) skin.castShadow = false;
    this.joints = new Joints(card.skeleton.parents);
    this.note = note(level, card, this.#now, this.#from);
  }

  tint(): void {
    this.#material.color = new Color(theme.levelColour(this.#level));
  }

  place(time: number, shift: Vector3): void {
    const { boneOffsets, frames, parents, rate, rootPosition, rotations } = this.motion!;
    const frame = Math.min(frames - 1, Math.max(0, Math.round(time * rate)));
    this.joints.place(this.motion!, frame);
    const [turns, root] = [4 * parents.length, 3 * frame];
    this.body.show({
      rotations: rotations.subarray(frame * turns, (frame + 1) * turns),
      root: rootPosition.subarray(root, root + 3),
      offsets: boneOffsets,
    });
    this.body.position.copy(shift);
  }

  /** finest: joints of level 0. */
  describe(camera: PerspectiveCamera, seen: Lens, ladder: Ladder, finest: Joints): void {
    const { most, rms } = apart(camera, seen.height, finest, this.joints, this.body.position);
    const now = `${pixels(rms)} px, worst ${pixels(most)}`;
    this.#now.textContent = this.#level ? now : "reference";
    this.#from.textContent = `from ${whole(Math.ceil(farEnough(ladder, this.#level, seen)))} m on`;
  }

  dispose(): void {
    this.body.dispose();
    this.#material.dispose();
  }
}

function note(level: number, card: ModelCard, now: HTMLElement, from: HTMLElement): HTMLElement {
  const { bytes, operations, rms, pose, ranks } = card.levels[level]!;
  const centimetres = (metres: number) => String(Number((100 * metres).toPrecision(2)));
  const rows = [
    ["size", el("dd", {}, `${digits(bytes / 1000)} kB`)],
    ["cost", el("dd", {}, `${whole(operations)} multiply-adds`)],
    ["off by", el("dd", {}, `${centimetres(rms)} cm, worst pose ${centimetres(pose)}`)],
    ["now", now],
    ["≤ 1 px", from],
  ] as const;
  const title = el("h3", {}, `Level ${level}`, el("small", {}, ranks.join(" × ")));
  const list = el("dl", {}, ...rows.flatMap(([term, value]) => [el("dt", {}, term), value]));
  return withLevel(el("article", {}, title, list), level);
}

const pixels = (value: number): string => value.toFixed(value < 10 ? 1 : 0);

/** Return the way from one character to the next, along the image. */
function spacing(camera: PerspectiveCamera, target: Vector3, count: number): Vector3 {
  const away = camera.position.distanceTo(target);
  const width = 2 * away * Math.tan((camera.fov * Math.PI) / 360) * camera.aspect;
  const right = new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
  return right
    .setY(0)
    .normalize()
    .multiplyScalar(width / count);
}

const [ONE, OTHER] = [new Vector3(), new Vector3()];

/** Return the greatest and the root mean square distance of joints of two poses, in pixels. */
function apart(
  camera: PerspectiveCamera,
  height: number,
  finest: Joints,
  other: Joints,
  shift: Vector3,
): { most: number; rms: number } {
  let [most, sum] = [0, 0];
  const joints = other.bones.length;
  for (let joint = 0; joint < joints; joint++) {
    finest.position(joint, ONE).add(shift).project(camera);
    other.position(joint, OTHER).add(shift).project(camera);
    const x = ((ONE.x - OTHER.x) * height * camera.aspect) / 2;
    const y = ((ONE.y - OTHER.y) * height) / 2;
    most = Math.max(most, Math.hypot(x, y));
    sum += x * x + y * y;
  }
  return { most, rms: Math.sqrt(sum / joints) };
}
