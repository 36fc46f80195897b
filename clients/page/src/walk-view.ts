/** Walkers that are steered by keys, a disc for a finger or a click on the ground; a crowd walks by itself. */

import type { Walkers } from "@posefield/runtime";
import { MathUtils, MeshLambertMaterial, Plane, Raycaster, Vector2, Vector3 } from "three";
import { el } from "../../viewer/src/dom.ts";
import { Figure, Stick } from "../../viewer/src/figure.ts";
import { NOWHERE } from "../../viewer/src/playback.ts";
import * as theme from "../../viewer/src/theme.ts";
import type { Stage } from "./clip-view.ts";
import type { View } from "./main.ts";

const KEYS: Readonly<Record<string, readonly [ahead: number, left: number]>> = {
  ...{ ArrowUp: [1, 0], KeyW: [1, 0], ArrowLeft: [0, 1], KeyA: [0, 1] },
  ...{ ArrowRight: [0, -1], KeyD: [0, -1], ShiftLeft: [-0.4, 0] },
};
/** Rate of turning, rad/s. */
const TURN = 1.6;
/** Walkers above which all are sticks. */
export const MANY = 12;
/** Metres between the walkers of a crowd; pixels of a drag. */
const [APART, DRAG] = [1.4, 4];

export class WalkView implements View {
  readonly ready: Promise<void>;
  readonly #stage: Stage;
  readonly #end = new AbortController();
  readonly #held = new Set<string>();
  /** Push of the disc ahead and to the left, -1 to 1. */
  #push: readonly [ahead: number, left: number] = [0, 0];
  readonly #disc = el("div", { class: "disc", "aria-hidden": "true" });
  #walkers: Walkers | null = null;
  #figures: readonly Figure[] = [];
  #crowd: Stick | null = null;
  /** Last press of the pointer. */
  #press: MouseEvent | null = null;
  #goals: (readonly [number, number] | null)[] = [];
  #computes = false;

  constructor(stage: Stage) {
    this.#stage = stage;
    this.ready = this.#begin();
    const { signal } = this.#end;
    addEventListener("keydown", (event) => this.#key(event, true), { signal });
    addEventListener("keyup", (event) => this.#key(event, false), { signal });
    addEventListener("blur", () => this.#held.clear(), { signal });
    const canvas = stage.scene.renderer.domElement;
    canvas.addEventListener("click", (event) => this.#click(event), { signal });
    canvas.addEventListener("pointerdown", (event) => (this.#press = event), { signal });
    if (matchMedia("(hover: none)").matches) canvas.after(this.#disc);
    for (const kind of ["pointerdown", "pointermove", "lostpointercapture"] as const)
      this.#disc.addEventListener(kind, (event) => this.#drag(event));
  }

  dispose(): void {
    this.#end.abort();
    this.#disc.remove();
    for (const figure of this.#figures) figure.dispose();
    this.#crowd?.removeFromParent();
    this.#crowd?.dispose();
  }

  async #begin(): Promise<void> {
    const { scene, model, card, character, panel } = this.#stage;
    const { count, body } = panel.state;
    const walkers = await model.walkers(count, panel.state.options);
    if (this.#end.signal.aborted) return;
    const side = Math.ceil(Math.sqrt(count));
    const half = Math.floor(side / 2);
    for (let index = 0; index < count; index++) {
      // The first one, which is steered, in the middle.
      const cell = (index + half * (side + 1)) % side ** 2;
      const [x, z] = [(cell % side) - half, Math.floor(cell / side) - half];
      walkers.put(index, [APART * x, APART * z], 0);
    }
    if (count > MANY) {
      const [bone, joint] = ["--ink", "--accent"].map(
        (name) => new MeshLambertMaterial({ color: theme.colour(name) }),
      );
      this.#crowd = new Stick(card, bone!, joint!, count);
      scene.root.add(this.#crowd);
    } else
      this.#figures = Array.from({ length: count }, () => {
        const figure = new Figure(card, character, false);
        figure.wear(body);
        scene.root.add(figure.group);
        return figure;
      });
    this.#goals = Array.from({ length: count }, () => null);
    this.#walkers = walkers;
    this.#show();
    scene.frame(Math.sqrt(side));
    scene.add((seconds) => this.#step(seconds), this.#end.signal);
  }

  /** Steer, and move all walkers on; a frame that comes too soon is left out. */
  #step(seconds: number): boolean {
    const walkers = this.#walkers!;
    if (this.#computes) return true;
    this.#computes = true;
    this.#steer(walkers);
    walkers
      .step(seconds)
      .then(() => this.#show())
      .finally(() => {
        this.#computes = false;
      });
    return true;
  }

  #steer(walkers: Walkers): void {
    const { card, panel } = this.#stage;
    const { name } = card.controls.find(({ measure }) => measure?.quantity === "speed")!;
    const speed = panel.state.controls[name]!;
    const keys = [...[...this.#held].map((code) => KEYS[code]!), this.#push];
    const steered = keys.some(([ahead, left]) => ahead || left);
    for (const [index, goal] of this.#goals.entries()) {
      if (index > 0 && !goal) this.#goals[index] = this.#somewhere();
      if (index === 0 && steered) this.#goals[0] = null;
      if (goal && walkers.steerTo(index, goal, speed) < 0.4) this.#goals[index] = null;
    }
    if (this.#goals[0]) return;
    const [ahead, left] = [0, 1].map((axis) =>
      keys.reduce((sum, key) => sum + key[axis as 0 | 1], 0),
    );
    walkers.steer(0, { speed: ahead! * speed, turn: left! * TURN });
  }

  /** A place for a walker of a crowd to go to. */
  #somewhere(): readonly [number, number] {
    const wide = APART * Math.sqrt(this.#goals.length);
    return [wide * (2 * Math.random() - 1), wide * (2 * Math.random() - 1)];
  }

  #show(): void {
    const { poses } = this.#walkers!;
    const joints = poses.names.length;
    for (let index = 0; index < this.#goals.length; index++) {
      const pose = {
        rotations: poses.rotations.subarray(4 * joints * index, 4 * joints * (index + 1)),
        root: poses.rootPosition.subarray(3 * index, 3 * index + 3),
        offsets: poses.boneOffsets,
      };
      this.#figures[index]?.show({ ...pose, carried: NOWHERE });
      this.#crowd?.show(pose, index);
    }
    this.#stage.scene.follow(poses.rootPosition[0]!, poses.rootPosition[2]!);
  }

  #key(event: KeyboardEvent, down: boolean): void {
    // Wherever a key is released.
    if (!down) this.#held.delete(event.code);
    if (!down || !(event.code in KEYS) || event.target instanceof HTMLInputElement) return;
    if (event.target instanceof HTMLSelectElement) return;
    event.preventDefault();
    this.#held.add(event.code);
  }

  /** Follow a finger on the disc until it leaves. */
  #drag({ type, pointerId, buttons, clientX, clientY }: PointerEvent): void {
    if (type === "pointerdown") this.#disc.setPointerCapture(pointerId);
    const { left, top, width, height } = this.#disc.getBoundingClientRect();
    const place = buttons ? [(clientX - left) / width, (clientY - top) / height] : [0.5, 0.5];
    const [x, y] = place.map((share) => MathUtils.clamp(share, 0, 1)) as [number, number];
    this.#disc.style.backgroundPosition = `${100 * x}% ${100 * y}%`;
    this.#push = [1 - 2 * y, 1 - 2 * x];
  }

  #click({ offsetX, offsetY, target }: MouseEvent): void {
    const press = this.#press;
    if (press && Math.hypot(offsetX - press.offsetX, offsetY - press.offsetY) > DRAG) return;
    const { camera } = this.#stage.scene;
    const { clientWidth, clientHeight } = target as HTMLElement;
    const at = new Vector2((2 * offsetX) / clientWidth - 1, 1 - (2 * offsetY) / clientHeight);
    const ray = new Raycaster();
    ray.setFromCamera(at, camera);
    const place = ray.ray.intersectPlane(new Plane(new Vector3(0, 1, 0), 0), new Vector3());
    if (place) this.#goals[0] = [place.x, place.z];
  }
}
