/** The view of a crowd, coloured by level of detail, each character at the coarsest that does not show. */

import { Frustum, Group, Matrix4, Sphere, Vector3 } from "three";

import { CrowdDrawing } from "./crowd-drawing.ts";
import { Crowd, fetchMotions, half, type Motions, TAKES } from "./crowd-motions.ts";
import { type Ladder, ladder, lens, pixels, withLevel } from "./detail.ts";
import { el, labelled, toggle } from "./dom.ts";
import { understood } from "./faults.ts";
import type { Session } from "./player.ts";
import { type Changes, has, type State } from "./state.ts";
import * as theme from "./theme.ts";
import { figure } from "./written.ts";

const [FEWEST, MOST] = [50, 10_000];
/** Powers of two between which the limit in pixels lies. */
const [SHARP, COARSE] = [-2, 4];
/** Most characters that the camera shows all of. */
const SHOWN = 1000;
/** Seconds between two changes of the numbers. */
const READING = 0.25;
/** Pixels to a metre from which on a character has all triangles. */
const FINE = 90;
/** Radius about a character that contains its body with arms out, m. */
const RADIUS = 1.3;

export function mount(host: HTMLElement, session: Session): void {
  new CrowdView(host, session);
}

class CrowdView {
  readonly #session: Session;
  readonly #panel: Panel;
  readonly #group = new Group();
  readonly #ladder: Ladder;
  readonly #frustum = new Frustum();
  readonly #sphere = new Sphere(new Vector3(), RADIUS);
  readonly #projection = new Matrix4();
  #motions: Motions | null = null;
  #loading = false;
  #crowd: Crowd | null = null;
  #drawing: CrowdDrawing | null = null;
  /** Camera of the view before. */
  #before: { position: Vector3; target: Vector3 } | null = null;
  /** Time of the last change of the numbers, and frames since then. */
  #read = { since: 0, frames: 0 };

  constructor(host: HTMLElement, session: Session) {
    this.#session = session;
    this.#ladder = ladder(session.card);
    this.#panel = new Panel(host, session);
    this.#group.visible = false;
    const { scene, signal, store } = session;
    scene.root.add(this.#group);
    store.listen((state, changed) => this.#update(state, changed), signal);
    scene.add((seconds) => this.#step(seconds), signal);
    signal.addEventListener("abort", () => {
      this.#leave();
      this.#group.removeFromParent();
      this.#disposeDrawing();
    });
    theme.listen(() => this.#tint(), signal);
    this.#update(store.state, new Set(["view"]));
  }

  #update(state: State, changed: Changes): void {
    if (changed.has("view")) {
      if (state.view === "crowd") this.#enter();
      else this.#leave();
    }
    if (changed.has("crowd") && this.#motions) this.#drawCharacters();
    if (changed.has("varied")) this.#motions = null;
    // The page changes controls when the service is back, and users may try again with one.
    if (has(changed, "controls", "varied")) void this.#loadMotions();
    if (changed.has("playing") && changed.has("time")) this.#loopTime(state);
    if (this.#group.visible) this.#session.scene.redraw();
  }

  #enter(): void {
    const { camera, orbit } = this.#session.scene;
    this.#before = { position: camera.position.clone(), target: orbit.target.clone() };
    this.#group.visible = true;
    this.#panel.show(true);
    this.#placeCamera();
    void this.#loadMotions();
  }

  #leave(): void {
    this.#group.visible = false;
    this.#panel.show(false);
    if (!this.#before) return;
    const { camera, orbit } = this.#session.scene;
    camera.position.copy(this.#before.position);
    orbit.target.copy(this.#before.target);
    orbit.update();
    this.#before = null;
  }

  /** Show near and far characters, from a corner of a thousand. */
  #placeCamera(): void {
    const { scene, store } = this.#session;
    const { camera, orbit } = scene;
    const far = half(Math.min(SHOWN, store.state.crowd));
    camera.position.set(far * 0.35, 4.5, far * 1.02);
    orbit.target.set(-far * 0.05, 0.5, far * 0.1);
    orbit.update();
  }

  /** The clip of one body ends where it does not loop; a crowd goes on. */
  #loopTime({ playing, time }: State): void {
    const ended = !playing && time >= this.#session.player.duration;
    if (this.#group.visible && ended) this.#session.store.set({ playing: true, time: 0 });
  }

  /** Fetch the motions, unless they are there; earlier ones are drawn until then. */
  async #loadMotions(): Promise<void> {
    if (!this.#group.visible || this.#motions || this.#loading) return;
    const { store, signal, notice } = this.#session;
    const { varied } = store.state;
    this.#loading = true;
    try {
      this.#panel.say("Computing the motions …");
      const progress = (share: number) => this.#panel.showProgress(share);
      this.#motions = await fetchMotions(this.#session, progress, varied);
      this.#panel.say("");
      if (!signal.aborted) this.#drawCharacters();
    } catch (fault) {
      if (signal.aborted) return;
      this.#panel.say(`The motions could not be computed. ${understood(fault)?.text ?? ""}`);
      notice(fault);
    } finally {
      this.#loading = false;
      this.#panel.showProgress(null);
      if (!signal.aborted && varied !== store.state.varied) {
        this.#motions = null;
        void this.#loadMotions();
      }
    }
  }

  #drawCharacters(): void {
    const { card, character, store } = this.#session;
    const count = Math.min(MOST, store.state.crowd);
    this.#disposeDrawing();
    this.#crowd = new Crowd(this.#motions!, count);
    const joints = card.skeleton.names.length;
    this.#drawing = new CrowdDrawing(character, this.#motions!, joints, count);
    this.#group.add(this.#drawing.group);
    this.#tint();
  }

  #disposeDrawing(): void {
    this.#drawing?.dispose();
  }

  #tint(): void {
    this.#drawing?.tint(this.#session.card.levels.map((_, level) => theme.levelColour(level)));
    this.#session.scene.redraw();
  }

  #step(seconds: number): boolean {
    if (!this.#group.visible || !this.#crowd) return false;
    const begun = performance.now();
    const { playing, speed, pixels: limit } = this.#session.store.state;
    const { camera, renderer } = this.#session.scene;
    if (playing) this.#crowd.step(seconds * speed);
    camera.updateMatrixWorld();
    const seen = lens(camera.fov, renderer.domElement);
    this.#crowd.chooseLevels(this.#ladder, seen, camera.position, limit);
    const visible = this.#visible((renderer.getPixelRatio() * pixels(seen)) / FINE);
    this.#drawing!.draw(this.#crowd, visible);
    this.#showNumbers(begun, visible.length);
    return playing;
  }

  /** Return the characters in view. near: distance within which they have all triangles, m. */
  #visible(near: number): (readonly [number, boolean])[] {
    const { count, x, z } = this.#crowd!;
    const { camera } = this.#session.scene;
    this.#frustum.setFromProjectionMatrix(
      this.#projection.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse),
    );
    const visible: (readonly [number, boolean])[] = [];
    for (let i = 0; i < count; i++) {
      this.#sphere.center.set(x[i]!, 0.9, z[i]!);
      if (!this.#frustum.intersectsSphere(this.#sphere)) continue;
      const [dx, dz] = [x[i]! - camera.position.x, z[i]! - camera.position.z];
      visible.push([i, dx * dx + dz * dz < near * near]);
    }
    return visible;
  }

  #showNumbers(begun: number, seen: number): void {
    const read = this.#read;
    read.frames++;
    if (begun - read.since < 1000 * READING) return;
    const playing = this.#session.store.state.playing && read.since;
    const frame = playing ? (begun - read.since) / read.frames : null;
    this.#panel.count(this.#crowd!.counts, seen, frame);
    this.#read = { since: begun, frames: 0 };
  }
}

/** Settings of the crowd, and its counts and times. */
class Panel {
  readonly #host = el("section", { class: "crowd", hidden: true, "aria-label": "Crowd" });
  readonly #status = el("p", { class: "about" });
  readonly #seen = el("p", { class: "about" });
  readonly #progress = el("progress", { max: 1, hidden: true, "aria-label": "Motions computed" });
  readonly #counts: readonly HTMLElement[];

  constructor(host: HTMLElement, session: Session) {
    const { card, signal, store } = session;
    this.#counts = card.levels.map(() => el("b", {}, "–"));
    const levels = this.#counts.map((count, level) =>
      withLevel(el("li", {}, `level ${level}`, count), level),
    );
    const about =
      card.cyclic && card.root === "travelling"
        ? "Characters walk along straight or gently curved paths, and re-enter on the opposite side."
        : "This model does not walk: each character stays in place and repeats a captured motion forwards and backwards.";
    const label = `No two alike: ${TAKES} motions instead of a few, each a take of its own`;
    const varied = toggle("No two alike", label, (on) => store.set({ varied: on }));
    store.follow((state) => varied.set(state.varied), signal);
    const count = slider(session, "crowd", [FEWEST, MOST, 50], Number, Number);
    const limit = slider(
      session,
      "pixels",
      [SHARP, COARSE, 0.25],
      (power) => Number((2 ** power).toPrecision(3)),
      Math.log2,
    );
    this.#host.append(
      el("h2", {}, "Crowd"),
      el("p", { class: "about" }, about),
      ...[this.#status, this.#progress, count, varied, limit],
      el("ul", {}, ...levels),
      this.#seen,
    );
    host.append(this.#host);
  }

  show(shown: boolean): void {
    this.#host.hidden = !shown;
  }

  say(text: string): void {
    this.#status.textContent = text;
  }

  /** share: of the motions that have come; null hides the bar. */
  showProgress(share: number | null): void {
    this.#progress.hidden = share === null;
    this.#progress.value = share ?? 0;
  }

  /** frame: milliseconds from a frame to the next; null where nothing moves. */
  count(counts: Int32Array, seen: number, frame: number | null): void {
    this.#counts.forEach((element, level) => {
      element.textContent = String(counts[level]);
    });
    const rate = frame ? `, ${Math.round(1000 / frame)} frames a second` : "";
    this.#seen.textContent = `${seen} in view${rate}`;
    if (frame) this.#host.dataset["frame"] = frame.toFixed(2);
  }
}

const TEXTS = {
  crowd: (value: number) => `${value.toLocaleString("en")} characters`,
  pixels: (value: number) => `errors up to ${figure(value)} px`,
} as const;

/** A slider of one of the state's numbers, which its label tells. */
function slider(
  { signal, store }: Session,
  key: keyof typeof TEXTS,
  [min, max, step]: readonly [number, number, number],
  valueAt: (position: number) => number,
  positionOf: (value: number) => number,
): HTMLElement {
  const input = el("input", { type: "range", min, max, step });
  const host = labelled("", input);
  store.follow((state) => {
    const text = TEXTS[key](state[key]);
    input.value = String(positionOf(state[key]));
    host.firstElementChild!.textContent = text;
    input.setAttribute("aria-valuetext", text);
  }, signal);
  input.addEventListener("input", () => store.set({ [key]: valueAt(Number(input.value)) }));
  return host;
}
