/** The stage: a camera, a ground, light, and one loop that draws only what changed. */

import {
  Color,
  DirectionalLight,
  HemisphereLight,
  PCFShadowMap,
  PerspectiveCamera,
  Scene as Root,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { Ground } from "./ground.ts";
import { isSoftware, Quality } from "./quality.ts";
import * as theme from "./theme.ts";

/** Called before each drawing with the seconds since the last; true asks to be called again. */
export type Step = (seconds: number) => boolean;

/** How far the body may be from where the camera looks before the camera goes along, m. */
const LEASH = 0.15;

export class Scene {
  readonly root = new Root();
  #leash = LEASH;
  readonly camera = new PerspectiveCamera(38, 1, 0.05, 500);
  readonly renderer: WebGLRenderer;
  readonly orbit: OrbitControls;
  /** Whether a processor draws, not a graphics card. */
  readonly software = isSoftware();
  readonly #quality: Quality;
  readonly #steps = new Set<Step>();
  readonly #ground = new Ground();
  #floor = 0;
  readonly #sun = sun();
  #asked = false;
  #cover: HTMLCanvasElement | null = null;
  readonly #drawn = new Set<() => void>();
  #last = 0;

  constructor(host: HTMLElement) {
    this.renderer = new WebGLRenderer({ antialias: !this.software });
    this.#quality = new Quality(this.renderer, this.software, () => this.redraw());
    if (this.software) this.#sun.shadow.mapSize.set(512, 512);
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    const canvas = this.renderer.domElement;
    canvas.setAttribute("aria-hidden", "true");
    // What the graphics card lost is made again by then, but not drawn.
    canvas.addEventListener("webglcontextrestored", () => this.redraw());
    host.append(canvas);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.maxPolarAngle = 0.53 * Math.PI;
    this.orbit.maxDistance = 60;
    this.frame();
    this.orbit.addEventListener("change", () => this.redraw());
    const sky = new HemisphereLight(0xffffff, 0x8d8f98, 1.7);
    this.root.add(sky, this.#sun, this.#sun.target, this.#ground.mesh);
    this.tint();
    theme.listen(() => this.tint());
    new ResizeObserver(() => this.#fit(host)).observe(host);
  }

  /** Returns how to take it away again. */
  add(step: Step): () => void {
    this.#steps.add(step);
    this.redraw();
    return () => this.#steps.delete(step);
  }

  /** Height of the ground, m. */
  get floor(): number {
    return this.#floor;
  }

  /** What is to be seen: the stage, and what lies over it. */
  get canvases(): readonly HTMLCanvasElement[] {
    return [this.renderer.domElement, ...(this.#cover ? [this.#cover] : [])];
  }

  /** Puts a canvas over the stage, which its owner draws, or takes it away. */
  cover(canvas: HTMLCanvasElement | null): void {
    this.#cover?.remove();
    this.#cover = canvas;
    if (canvas) this.renderer.domElement.after(canvas);
  }

  /** Calls after each drawing; returns how to end that. */
  watch(seen: () => void): () => void {
    this.#drawn.add(seen);
    return () => this.#drawn.delete(seen);
  }

  /** Draws once at the next chance, and on while a step asks for it. */
  redraw(): void {
    if (this.#asked) return;
    this.#asked = true;
    requestAnimationFrame((now) => this.#draw(now));
  }

  /**
   * Shows the whole of a body at the origin. `scale`: its size relative to a person's; `middle`: the
   * height of its middle, m.
   */
  frame(scale = 1, middle = 0.88): void {
    this.#leash = LEASH * scale;
    this.orbit.minDistance = 0.5 * Math.min(1, scale);
    this.camera.position.set(1.75 * scale, middle + 0.67 * scale, 3.05 * scale);
    this.orbit.target.set(0, middle, 0);
    this.orbit.update();
    this.#light();
  }

  /** Goes along with a body at that place on the ground, on a loose leash. */
  follow(x: number, z: number): void {
    const { target } = this.orbit;
    const way = Math.hypot(x - target.x, z - target.z);
    if (way <= this.#leash) return;
    const share = 1 - this.#leash / way;
    const [dx, dz] = [share * (x - target.x), share * (z - target.z)];
    for (const place of [target, this.camera.position]) {
      place.x += dx;
      place.z += dz;
    }
    this.orbit.update();
    this.#light();
  }

  /** Lays the ground at a height, m. */
  lay(floor: number): void {
    if (floor === this.#floor) return;
    this.#floor = floor;
    this.#light();
    this.redraw();
  }

  /** Shows that place on the ground from above, +Z upwards; `size`: of what is to be seen, m. */
  above(x: number, z: number, size: number): void {
    const half = Math.tan((this.camera.fov * Math.PI) / 360) * Math.min(1, this.camera.aspect);
    const up = Math.min(this.orbit.maxDistance, Math.max(3, (0.6 * size) / half));
    this.orbit.target.set(x, 0, z);
    // Never straight down, where the camera would not know which way is up.
    this.camera.position.set(x, up, z - 0.02 * up);
    this.orbit.update();
    this.#light();
    this.redraw();
  }

  tint(): void {
    this.root.background = new Color(theme.colour("--paper"));
    this.#ground.tint(
      theme.colour("--paper"),
      theme.colour("--grid"),
      theme.isDark() ? 0.55 : 0.82,
    );
    this.redraw();
  }

  /** Shadows and ground are where one looks. */
  #light(): void {
    const { x, z } = this.orbit.target;
    this.#sun.position.set(x + 1.8, 4.5, z + 2.2);
    this.#sun.target.position.set(x, 0.6, z);
    this.#ground.mesh.position.set(x, this.#floor, z);
  }

  #draw(now: number): void {
    const since = now - this.#last;
    const seconds = Math.min(0.1, since / 1000);
    this.#last = now;
    this.#quality.drawing(since);
    this.#asked = false;
    const goOn = [...this.#steps].map((step) => step(seconds)).some(Boolean);
    this.renderer.render(this.root, this.camera);
    for (const seen of this.#drawn) seen();
    if (goOn) this.redraw();
  }

  #fit(host: HTMLElement): void {
    const { clientWidth: width, clientHeight: height } = host;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
    this.redraw();
  }
}

function sun(): DirectionalLight {
  const light = new DirectionalLight(0xffffff, 2);
  light.castShadow = true;
  light.shadow.mapSize.set(1024, 1024);
  light.shadow.radius = 3;
  light.shadow.bias = -0.0006;
  light.shadow.normalBias = 0.01;
  Object.assign(light.shadow.camera, { left: -1.6, right: 1.6, top: 1.8, bottom: -1.6, far: 12 });
  return light;
}
