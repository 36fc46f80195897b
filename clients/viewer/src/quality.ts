/** How finely is drawn: as finely as this machine can while things move, and finer at rest. */

import type { WebGLRenderer } from "three";

/** Pixels a CSS pixel, in one direction. */
const COARSEST = 0.5;
/** Milliseconds a frame, slower and faster than which something is done about it. */
const SLOW = 34;
const FAST = 20;
/** Milliseconds without a drawing after which one is worth drawing well. */
const REST = 300;

/** Whether a processor draws, not a graphics card. */
export function isSoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  const known = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && known ? String(gl.getParameter(known.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

export class Quality {
  readonly #renderer: WebGLRenderer;
  readonly #redraw: () => void;
  /** Where edges are not smoothed otherwise, by drawing twice as finely at rest. */
  readonly #finest: number;
  #moving: number;
  #ratio = 0;
  #mean = 25;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #resting = false;

  constructor(renderer: WebGLRenderer, software: boolean, redraw: () => void) {
    this.#renderer = renderer;
    this.#redraw = redraw;
    this.#moving = software ? 1 : this.#own;
    this.#finest = software ? 2 : 1;
  }

  get #own(): number {
    return Math.min(devicePixelRatio, 2);
  }

  /** Before a drawing, which comes so many milliseconds after the last. */
  drawing(since: number): void {
    if (!this.#resting) {
      if (since < REST) this.#judge(since);
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#rest(), REST);
    }
    // A mark for who tests the page: nothing has moved since.
    this.#renderer.domElement.toggleAttribute("data-rest", this.#resting);
    this.#use(this.#resting ? Math.max(this.#own, this.#finest) : this.#moving);
    this.#resting = false;
  }

  #rest(): void {
    this.#resting = true;
    this.#redraw();
  }

  /** Coarser where frames take too long, finer where there is time. */
  #judge(since: number): void {
    this.#mean += 0.15 * (Math.min(since, 150) - this.#mean);
    if (this.#mean > SLOW && this.#moving > COARSEST) this.#change(0.8);
    else if (this.#mean < FAST && this.#moving < this.#own) this.#change(1.1);
  }

  #change(factor: number): void {
    this.#moving = Math.min(this.#own, Math.max(COARSEST, this.#moving * factor));
    this.#mean = (SLOW + FAST) / 2;
  }

  #use(ratio: number): void {
    if (Math.abs(ratio - this.#ratio) < 0.01) return;
    this.#ratio = ratio;
    this.#renderer.setPixelRatio(ratio);
  }
}
