/** All levels of detail side by side: the same moment, and how far each is off as seen from here. */

import type { ClipQuestion, Motion } from "@posefield/client";
import { Color, Group, MeshStandardMaterial, type PerspectiveCamera, Vector3 } from "three";

import "./levels.css";
import { levelColour } from "./colours.ts";
import { type Ladder, ladder, lens } from "./detail.ts";
import { el } from "./dom.ts";
import { Ghost } from "./ghost-lines.ts";
import { Latest } from "./latest.ts";
import { type Apart, Note } from "./level-notes.ts";
import type { Mount, Page } from "./page.ts";
import { type Placed, place, placed } from "./skeleton.ts";
import { SkinnedBody } from "./skinned-body.ts";
import type { State } from "./state.ts";
import { TAKE_AND_FEET, takeAndFeet } from "./takes.ts";
import * as theme from "./theme.ts";

/** Frames a second of the clips: what a screen shows. */
const RATE = 60;
/** Seconds between two changes of the numbers that are read. */
const READING = 0.15;
/** How far the picture moves up, as a share of its height. */
const RAISED = 0.12;

export const mount: Mount = (host, page) => new Levels(host, page).begin();

/** One level's character, and where its joints are now. */
interface Figure {
  readonly body: SkinnedBody;
  readonly material: MeshStandardMaterial;
  readonly ghost: Ghost;
  readonly joints: Placed;
  readonly note: Note;
  motion: Motion | null;
}

class Levels {
  readonly #page: Page;
  readonly #host = el("section", {
    class: "levels",
    hidden: true,
    "aria-label": "Levels of detail",
  });
  readonly #group = new Group();
  readonly #ladder: Ladder;
  readonly #figures: Figure[];
  readonly #asking: Latest<ClipQuestion>;
  #since = READING;

  constructor(host: HTMLElement, page: Page) {
    this.#page = page;
    this.#ladder = ladder(page.card);
    this.#figures = page.card.levels.map((_, level) => this.#figure(level));
    this.#group.visible = false;
    this.#host.append(...this.#figures.map(({ note }) => note.host));
    this.#asking = new Latest((question) => this.#ask(question));
    page.scene.root.add(this.#group);
    host.append(this.#host);
  }

  begin(): void {
    const { store, scene, signal } = this.#page;
    const ends = [
      store.listen((state, changed) => this.#changed(state, changed)),
      scene.add((seconds) => this.#step(seconds)),
    ];
    signal.addEventListener("abort", () => {
      for (const end of ends) end();
      if (this.#group.visible) scene.camera.clearViewOffset();
      this.#host.remove();
      this.#group.removeFromParent();
      for (const { body, ghost, material } of this.#figures) {
        body.dispose();
        material.dispose();
        ghost.dispose();
      }
    });
    theme.listen(() => this.#paint(), signal);
    this.#paint();
    this.#show(store.state);
  }

  #figure(level: number): Figure {
    const material = new MeshStandardMaterial({ roughness: 0.75 });
    const { card, character } = this.#page;
    const body = new SkinnedBody(card, character, [material]);
    // The light's shadows reach as far as one body does.
    for (const skin of body.children) skin.castShadow = false;
    const ghost = new Ghost(card, level > 0);
    this.#group.add(body, ghost.lines);
    const joints = placed(card.skeleton.parents.length);
    return { body, material, ghost, joints, note: new Note(level, card), motion: null };
  }

  #paint(): void {
    this.#figures.forEach(({ material, ghost }, level) => {
      material.color = new Color(levelColour(level));
      ghost.paint();
    });
    this.#page.scene.redraw();
  }

  #changed(state: State, changed: ReadonlySet<keyof State>): void {
    const asked = ["controls", "performer", "labels", "root", "view", ...TAKE_AND_FEET] as const;
    if (asked.some((key) => changed.has(key))) this.#show(state);
    if (changed.has("time") && this.#group.visible) this.#page.scene.redraw();
  }

  #show(state: State): void {
    if (this.#group.visible && state.view !== "levels") this.#page.scene.camera.clearViewOffset();
    this.#group.visible = state.view === "levels";
    this.#host.hidden = !this.#group.visible;
    this.#page.scene.redraw();
    if (!this.#group.visible) return;
    const { card } = this.#page;
    // Who walks away would not stay side by side.
    const root = card.cyclic ? "in_place" : state.root;
    const { controls, labels, performer } = state;
    const how = takeAndFeet(this.#page.source, card, state);
    this.#asking.ask({ controls, performer, labels, root, fps: RATE, ...how });
  }

  async #ask(question: ClipQuestion): Promise<void> {
    const { source, store, signal, notice } = this.#page;
    try {
      const asked = this.#figures.map((_, level) =>
        source.clip(store.state.model, { ...question, level }, signal),
      );
      (await Promise.all(asked)).forEach((motion, level) => {
        this.#figures[level]!.motion = motion;
      });
      this.#page.scene.redraw();
    } catch (fault) {
      if (!signal.aborted) notice(fault);
    }
  }

  #step(seconds: number): boolean {
    if (!this.#group.visible || !this.#figures.every(({ motion }) => motion)) return false;
    const { store, scene } = this.#page;
    raise(scene.camera, scene.renderer.domElement);
    const aside = beside(scene.camera, scene.orbit.target, this.#figures.length);
    for (const [level, figure] of this.#figures.entries()) {
      this.#place(figure, level, store.state.time, aside);
    }
    this.#since += seconds;
    if (this.#since > READING || !store.state.playing) {
      this.#since = 0;
      this.#tell();
    }
    return store.state.playing;
  }

  #place(figure: Figure, level: number, time: number, aside: Vector3): void {
    const motion = figure.motion!;
    const frame = Math.min(motion.frames - 1, Math.max(0, Math.round(time * motion.rate)));
    const { rotations, rootPosition, boneOffsets, parents } = motion;
    place(figure.joints, parents, boneOffsets, rotations, rootPosition, frame);
    const [turns, root] = [4 * parents.length, 3 * frame];
    figure.body.show({
      rotations: rotations.subarray(frame * turns, (frame + 1) * turns),
      root: rootPosition.subarray(root, root + 3),
      offsets: boneOffsets,
    });
    const shift = aside.clone().multiplyScalar(level - (this.#figures.length - 1) / 2);
    figure.body.position.copy(shift);
    figure.ghost.place(this.#figures[0]!.joints, shift);
  }

  #tell(): void {
    const { camera, renderer } = this.#page.scene;
    camera.updateMatrixWorld();
    const seen = lens(camera.fov, renderer.domElement);
    const size = [seen.height * camera.aspect, seen.height] as const;
    for (const { joints, note, body } of this.#figures) {
      note.show(
        apart(camera, size, this.#figures[0]!.joints, joints, body.position),
        this.#ladder,
        seen,
      );
    }
  }
}

/** Moves the picture up, so that notes hide nobody's feet. */
function raise(camera: PerspectiveCamera, { clientWidth, clientHeight }: HTMLCanvasElement): void {
  const up = RAISED * clientHeight;
  camera.setViewOffset(clientWidth, clientHeight, 0, up, clientWidth, clientHeight);
}

/** From one character to the next: along the image, so that each stands above its column. */
function beside(camera: PerspectiveCamera, target: Vector3, count: number): Vector3 {
  const away = camera.position.distanceTo(target);
  const width = 2 * away * Math.tan((camera.fov * Math.PI) / 360) * camera.aspect;
  const right = new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
  return right
    .setY(0)
    .normalize()
    .multiplyScalar(width / count);
}

const [ONE, OTHER] = [new Vector3(), new Vector3()];

/** How far joints lie from those of another pose, in pixels of the image, both standing there. */
export function apart(
  camera: PerspectiveCamera,
  [width, height]: readonly [number, number],
  right: Placed,
  found: Placed,
  shift: Vector3,
): Apart {
  let [most, sum] = [0, 0];
  const joints = found.positions.length / 3;
  for (let joint = 0; joint < joints; joint++) {
    ONE.fromArray(right.positions, 3 * joint)
      .add(shift)
      .project(camera);
    OTHER.fromArray(found.positions, 3 * joint)
      .add(shift)
      .project(camera);
    const [x, y] = [((ONE.x - OTHER.x) * width) / 2, ((ONE.y - OTHER.y) * height) / 2];
    most = Math.max(most, Math.hypot(x, y));
    sum += x * x + y * y;
  }
  return { most, rms: Math.sqrt(sum / joints) };
}
