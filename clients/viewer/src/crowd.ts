/** A crowd coloured by level of detail, each character at the coarsest that does not show. */

import {
  BufferAttribute,
  BufferGeometry,
  Frustum,
  Group,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Sphere,
  Vector3,
} from "three";

import "./crowd.css";
import { levelColour } from "./colours.ts";
import { BakedCrowd } from "./crowd-baked.ts";
import { type Library, library, type Motions } from "./crowd-library.ts";
import { type CrowdDrawing, CrowdMesh } from "./crowd-mesh.ts";
import { Panel } from "./crowd-panel.ts";
import { Crowd, half, REACH } from "./crowd-walk.ts";
import { type ComputedCrowd, open, WebGpuCrowd } from "./crowd-webgpu.ts";
import { type Ladder, ladder, lens, pixels } from "./detail.ts";
import { understood } from "./faults.ts";
import { served } from "./page.ts";
import type { Session } from "./session.ts";
import type { State } from "./state.ts";
import * as theme from "./theme.ts";

export const MOST = 10_000;
/** Most characters that are drawn as one mesh of them all, where a processor draws. */
const ONE_MESH = 1000;
/** Metres between lines of the ground, and seconds between two readings of numbers. */
const [GROUND, READING] = [5, 0.25];
/** Pixels to a metre from which on a character has all triangles. */
const FINE = 90;

export function mount(host: HTMLElement, session: Session): void {
  new CrowdView(host, session).begin();
}

class CrowdView {
  readonly #page: Session;
  readonly #panel: Panel;
  readonly #group = new Group();
  readonly #ladder: Ladder;
  readonly #frustum = new Frustum();
  readonly #sphere = new Sphere(new Vector3(), REACH);
  #library: Library | null = null;
  /** In browsers with WebGPU, in place of a library. */
  #computed: ComputedCrowd | null = null;
  #lost = false;
  #loading = false;
  #crowd: Crowd | null = null;
  #mesh: CrowdDrawing | null = null;
  #ground: LineSegments<BufferGeometry, LineBasicMaterial> | null = null;
  #before: { position: Vector3; target: Vector3 } | null = null;
  #since = 0;
  #frames = 0;
  #spent = 0;
  #begun = 0;

  constructor(host: HTMLElement, page: Session) {
    this.#page = page;
    this.#ladder = ladder(page.card);
    this.#panel = new Panel(host, page);
    this.#group.visible = false;
    page.scene.root.add(this.#group);
  }

  begin(): void {
    const { store, scene, signal } = this.#page;
    const ends = [
      store.listen((state, changed) => this.#changed(state, changed)),
      scene.add((seconds) => this.#step(seconds)),
    ];
    signal.addEventListener("abort", () => {
      for (const end of ends) end();
      this.#leave();
      this.#group.removeFromParent();
      this.#bare();
      this.#computed?.drawing.dispose();
    });
    theme.listen(() => this.#paint(), signal);
    this.#paint();
    this.#changed(store.state, new Set(["view"]));
  }

  #changed(state: State, changed: ReadonlySet<keyof State>): void {
    if (changed.has("view")) {
      if (state.view === "crowd") this.#enter();
      else this.#leave();
    }
    if (changed.has("crowd") && this.#motions) this.#people();
    if (changed.has("varied")) this.#again();
    // The page says so when the service is back, and one may move a control to try again.
    if (changed.has("controls")) this.#want();
    if (changed.has("playing") && changed.has("time")) this.#goOn(state);
    if (this.#group.visible) this.#page.scene.redraw();
  }

  #enter(): void {
    const { camera, orbit } = this.#page.scene;
    this.#before = { position: camera.position.clone(), target: orbit.target.clone() };
    this.#group.visible = true;
    this.#cover();
    this.#panel.show(true);
    this.#look();
    this.#want();
  }

  #want(): void {
    if (this.#group.visible && !this.#motions && !this.#loading) void this.#load();
  }

  get #motions(): Motions | null {
    return this.#computed?.motions ?? this.#library;
  }

  /** Shows the canvas of a crowd that has its own, while the crowd is shown. */
  #cover(): void {
    const own = this.#mesh instanceof WebGpuCrowd && this.#group.visible;
    this.#page.scene.cover(own ? this.#computed!.drawing.canvas : null);
  }

  /** The clip of one body ends where it does not loop; a crowd does not. */
  #goOn({ playing, time }: State): void {
    const ended = !playing && time >= this.#page.player.duration;
    if (this.#group.visible && ended) this.#page.store.set({ playing: true, time: 0 });
  }

  #leave(): void {
    this.#group.visible = false;
    this.#cover();
    this.#panel.show(false);
    if (!this.#before) return;
    const { camera, orbit } = this.#page.scene;
    camera.position.copy(this.#before.position);
    orbit.target.copy(this.#before.target);
    orbit.update();
    this.#before = null;
  }

  /** From a corner of a thousand, so that near and far are both in view; more stand around it. */
  #look(): void {
    const { scene, store } = this.#page;
    const { camera, orbit } = scene;
    const far = half(Math.min(ONE_MESH, store.state.crowd));
    camera.position.set(far * 0.35, 4.5, far * 1.02);
    orbit.target.set(-far * 0.05, 0.5, far * 0.1);
    orbit.update();
  }

  /** Other motions; those that are there go on until then. */
  #again(): void {
    this.#library = null;
    this.#forget();
    this.#want();
  }

  #forget(): void {
    if (this.#mesh instanceof WebGpuCrowd) {
      this.#mesh = null;
      this.#crowd = null;
      this.#cover();
    }
    this.#computed?.drawing.dispose();
    this.#computed = null;
  }

  async #load(): Promise<void> {
    const { source, store, card, signal, notice } = this.#page;
    const { varied } = store.state;
    this.#loading = true;
    try {
      this.#panel.say("Computing the motions …");
      const done = (share: number) => this.#panel.progress(share);
      const takes = varied && served(source);
      if (!takes && !this.#lost) {
        this.#computed = await open(this.#page, done, MOST, () => {
          this.#lost = true;
          this.#again();
        });
      }
      if (!this.#computed)
        this.#library = await library(source, store.state.model, card, signal, done, takes);
      this.#panel.say("");
      if (!signal.aborted) this.#people();
    } catch (fault) {
      if (signal.aborted) return;
      this.#panel.say(`The motions could not be computed. ${understood(fault)?.text ?? ""}`);
      notice(fault);
    } finally {
      this.#loading = false;
      this.#panel.progress(null);
      if (!signal.aborted && varied !== store.state.varied) this.#again();
    }
  }

  #people(): void {
    this.#crowd = new Crowd(this.#motions!, Math.min(MOST, this.#page.store.state.crowd));
    this.#bare();
    this.#mesh = this.#computed?.drawing ?? this.#drawn(this.#library!, this.#crowd.count);
    this.#cover();
    this.#group.add(this.#mesh.group);
    this.#ground = ground(this.#crowd.half);
    this.#group.add(this.#ground);
    this.#paint();
  }

  /** Who draws so many by WebGL. */
  #drawn(own: Library, count: number): CrowdDrawing {
    const { card, character, scene } = this.#page;
    const joints = card.skeleton.names.length;
    return scene.software && count <= ONE_MESH
      ? new CrowdMesh(character, own, joints, count)
      : new BakedCrowd(character, own, joints, count);
  }

  #bare(): void {
    this.#mesh?.group.removeFromParent();
    if (!(this.#mesh instanceof WebGpuCrowd)) this.#mesh?.dispose();
    this.#ground?.geometry.dispose();
    this.#ground?.material.dispose();
    this.#ground?.removeFromParent();
  }

  #paint(): void {
    this.#mesh?.paint(this.#page.card.levels.map((_, level) => levelColour(level)));
    this.#ground?.material.color.set(theme.colour("--line"));
    this.#page.scene.redraw();
  }

  #step(seconds: number): boolean {
    if (!this.#group.visible || !this.#crowd) return false;
    const begun = performance.now();
    const { playing, speed, pixels } = this.#page.store.state;
    const { camera, renderer } = this.#page.scene;
    if (playing) this.#crowd.step(seconds * speed);
    camera.updateMatrixWorld();
    const seen = lens(camera.fov, renderer.domElement);
    this.#crowd.detail(this.#ladder, seen, camera.position, pixels);
    this.#read(begun, this.#fill());
    return playing;
  }

  /** Writes where all are who may be seen; gives how many they are. */
  #fill(): number {
    const [crowd, mesh] = [this.#crowd!, this.#mesh!];
    const { camera, renderer } = this.#page.scene;
    this.#frustum.setFromProjectionMatrix(
      VIEW.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse),
    );
    const near = (renderer.getPixelRatio() * pixels(lens(camera.fov, renderer.domElement))) / FINE;
    let seen = 0;
    mesh.begin();
    for (let i = 0; i < crowd.count; i++) {
      this.#sphere.center.set(crowd.x[i]!, 0.9, crowd.z[i]!);
      if (!this.#frustum.intersectsSphere(this.#sphere)) continue;
      const [x, z] = [crowd.x[i]! - camera.position.x, crowd.z[i]! - camera.position.z];
      mesh.add(x * x + z * z < near * near, crowd, i);
      seen++;
    }
    mesh.end();
    return seen;
  }

  #read(begun: number, seen: number): void {
    this.#frames++;
    this.#spent += performance.now() - begun;
    if (begun - this.#begun < 1000 * READING && this.#since) return;
    const frame = (begun - this.#begun) / this.#frames;
    this.#panel.count(this.#crowd!.counts, seen);
    if (this.#page.store.state.playing) this.#panel.time(frame, this.#spent / this.#frames);
    [this.#frames, this.#spent, this.#begun, this.#since] = [0, 0, begun, 1];
  }
}

const VIEW = new Matrix4();

function ground(half: number): LineSegments<BufferGeometry, LineBasicMaterial> {
  const ends: number[] = [];
  const side = Math.ceil(half / GROUND) * GROUND;
  for (let at = -side; at <= side; at += GROUND) {
    ends.push(at, 0, -side, at, 0, side, -side, 0, at, side, 0, at);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(ends), 3));
  return new LineSegments(geometry, new LineBasicMaterial());
}
