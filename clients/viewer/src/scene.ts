/** The stage: a camera, a ground, light, and one loop that draws only what changed. */

import {
  Color,
  DirectionalLight,
  GridHelper,
  HemisphereLight,
  PerspectiveCamera,
  Scene as Root,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

/** Called before each drawing with the seconds since the last; true asks to be called again. */
export type Step = (seconds: number) => boolean;

export class Scene {
  readonly root = new Root();
  readonly camera = new PerspectiveCamera(45, 1, 0.05, 500);
  readonly renderer: WebGLRenderer;
  readonly orbit: OrbitControls;
  readonly #steps = new Set<Step>();
  #asked = false;
  #last = 0;

  constructor(host: HTMLElement) {
    this.renderer = new WebGLRenderer({ antialias: true });
    host.append(this.renderer.domElement);
    this.orbit = new OrbitControls(this.camera, this.renderer.domElement);
    this.camera.position.set(2.4, 1.7, 3.2);
    this.orbit.target.set(0, 0.9, 0);
    this.orbit.update();
    this.orbit.addEventListener("change", () => this.redraw());
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(2, 5, 3);
    this.root.add(
      new HemisphereLight(0xffffff, 0x8899aa, 1.6),
      sun,
      new GridHelper(10, 20, 0x888888, 0xbbbbbb),
    );
    this.root.background = new Color(0xf4f5f7);
    new ResizeObserver(() => this.#fit(host)).observe(host);
  }

  /** Returns how to take it away again. */
  add(step: Step): () => void {
    this.#steps.add(step);
    this.redraw();
    return () => this.#steps.delete(step);
  }

  /** Draws once at the next chance, and on while a step asks for it. */
  redraw(): void {
    if (this.#asked) return;
    this.#asked = true;
    requestAnimationFrame((now) => this.#draw(now));
  }

  #draw(now: number): void {
    const seconds = Math.min(0.1, (now - this.#last) / 1000);
    this.#last = now;
    this.#asked = false;
    const goOn = [...this.#steps].map((step) => step(seconds)).some(Boolean);
    this.renderer.render(this.root, this.camera);
    if (goOn) this.redraw();
  }

  #fit(host: HTMLElement): void {
    const { clientWidth: width, clientHeight: height } = host;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
    this.redraw();
  }
}
