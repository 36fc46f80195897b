/** The stage: a camera, a ground, light, and one loop that draws when something has changed. */

import {
  CanvasTexture,
  Color,
  DirectionalLight,
  Fog,
  HemisphereLight,
  Mesh,
  MeshBasicMaterial,
  PCFShadowMap,
  PerspectiveCamera,
  PlaneGeometry,
  RepeatWrapping,
  Scene as Root,
  ShadowMaterial,
  type Texture,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { el } from "./dom.ts";
import * as theme from "./theme.ts";

/** Called before each drawing with the seconds since the last; true asks to be called again. */
export type Step = (seconds: number) => boolean;

/** Distance of the body from the camera's target from which on the camera follows it, m. */
const LEASH = 0.15;

export class Scene {
  readonly root = new Root();
  readonly camera = new PerspectiveCamera(38, 1, 0.05, 500);
  readonly renderer: WebGLRenderer;
  readonly orbit: OrbitControls;
  readonly #quality: Quality;
  readonly #steps = new Set<Step>();
  /** Lines a metre apart, which fade into the distance, and the ground in shadow. */
  readonly #lines = new Mesh(GROUND, new MeshBasicMaterial({ map: squares(), transparent: true }));
  readonly #shade = new Mesh(GROUND, new ShadowMaterial({ fog: false }));
  readonly #fog = new Fog(0);
  #leash = LEASH;
  #floor = 0;
  readonly #sun = sun();
  #asked = false;
  #last = 0;

  constructor(host: HTMLElement) {
    const plain = new WebGLRenderer({ antialias: false });
    const software = isSoftware(plain.getContext());
    if (!software) plain.forceContextLoss();
    this.renderer = software ? plain : new WebGLRenderer({ antialias: true });
    this.#quality = new Quality(this.renderer, software, () => this.redraw());
    if (software) this.#sun.shadow.mapSize.set(512, 512);
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    const canvas = this.renderer.domElement;
    canvas.setAttribute("aria-hidden", "true");
    // By then three.js has restored everything, but not drawn it.
    canvas.addEventListener("webglcontextrestored", () => this.redraw());
    host.append(canvas);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.maxPolarAngle = 0.53 * Math.PI;
    this.orbit.maxDistance = 60;
    this.frame();
    this.orbit.addEventListener("change", () => this.redraw());
    const sky = new HemisphereLight(0xffffff, 0x8d8f98, 1.7);
    this.root.add(sky, this.#sun, this.#sun.target, this.#lines, this.#shade);
    this.root.fog = this.#fog;
    this.#shade.receiveShadow = true;
    // Shadows fall near the middle, and cost where they are looked for.
    this.#shade.scale.setScalar(5.2 / SIZE);
    this.tint();
    theme.listen(() => this.tint());
    new ResizeObserver(() => this.#fit(host)).observe(host);
  }

  /** Call the step before each drawing, until the signal. */
  add(step: Step, signal: AbortSignal): void {
    if (signal.aborted) return;
    this.#steps.add(step);
    signal.addEventListener("abort", () => this.#steps.delete(step));
    this.redraw();
  }

  /** Draw once in the next frame, and on while a step asks for it; an empty stage is not drawn. */
  redraw(): void {
    if (this.#asked || !this.#steps.size) return;
    this.#asked = true;
    requestAnimationFrame((now) => this.#draw(now));
  }

  /**
   * Show all of a body at the origin.
   *
   * scale: its size relative to a person's. middle: height of its middle, m.
   */
  frame(scale = 1, middle = 0.88): void {
    this.#leash = LEASH * scale;
    this.orbit.minDistance = 0.5 * Math.min(1, scale);
    this.camera.position.set(1.75 * scale, middle + 0.67 * scale, 3.05 * scale);
    this.orbit.target.set(0, middle, 0);
    this.orbit.update();
    this.#light();
  }

  /** Follow a body at that point of the ground, on a loose leash. */
  follow(x: number, z: number): void {
    const { target } = this.orbit;
    const way = Math.hypot(x - target.x, z - target.z);
    if (way <= this.#leash) return;
    const share = 1 - this.#leash / way;
    const [dx, dz] = [share * (x - target.x), share * (z - target.z)];
    for (const point of [target, this.camera.position]) {
      point.x += dx;
      point.z += dz;
    }
    this.orbit.update();
    this.#light();
  }

  /** Set the height of the ground, m. */
  setFloor(floor: number): void {
    if (floor === this.#floor) return;
    this.#floor = floor;
    this.#light();
    this.redraw();
  }

  tint(): void {
    this.root.background = new Color(theme.colour("--paper"));
    this.#fog.color.set(theme.colour("--paper"));
    this.#lines.material.color.set(theme.colour("--grid"));
    this.#shade.material.opacity = theme.isDark() ? 0.45 : 0.18;
    this.redraw();
  }

  /** Move shadows and ground to where the camera looks. */
  #light(): void {
    const { x, z } = this.orbit.target;
    this.#sun.position.set(x + 1.8, 4.5, z + 2.2);
    this.#sun.target.position.set(x, 0.6, z);
    this.#lines.position.set(Math.round(x), this.#floor, Math.round(z));
    this.#shade.position.set(x, this.#floor + 0.002, z);
  }

  #draw(now: number): void {
    const since = now - this.#last;
    const seconds = Math.min(0.1, since / 1000);
    this.#last = now;
    this.#quality.drawing(since);
    this.#asked = false;
    const again = [...this.#steps].map((step) => step(seconds)).some(Boolean);
    const far = this.camera.position.distanceTo(this.orbit.target);
    [this.#fog.near, this.#fog.far] = [far, 2.5 * far + 8];
    this.renderer.render(this.root, this.camera);
    if (again) this.redraw();
  }

  #fit(host: HTMLElement): void {
    const { clientWidth: width, clientHeight: height } = host;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
    this.redraw();
  }
}

/** Metres of the ground's sides, and pixels of the picture of a square metre. */
const [SIZE, PIXELS] = [60, 128];
const GROUND = new PlaneGeometry(SIZE, SIZE).rotateX(-Math.PI / 2);

/** White lines a metre apart. */
function squares(): Texture {
  const canvas = el("canvas", { width: PIXELS, height: PIXELS });
  const pen = canvas.getContext("2d")!;
  pen.strokeStyle = "#fff6";
  pen.lineWidth = 2;
  pen.strokeRect(0, 0, PIXELS, PIXELS);
  const texture = new CanvasTexture(canvas);
  texture.wrapS = texture.wrapT = RepeatWrapping;
  texture.repeat.setScalar(SIZE);
  texture.anisotropy = 8;
  return texture;
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

/** Pixels a CSS pixel, in one direction. */
const COARSEST = 0.5;
/** Milliseconds a frame above which drawings become coarser, and below which finer. */
const SLOW = 34;
const FAST = 20;
/** Milliseconds without a drawing until one is drawn as finely as possible. */
const REST = 300;

/** Tell whether a processor draws, not a graphics card. */
function isSoftware(gl: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const known = gl.getExtension("WEBGL_debug_renderer_info");
  const name = known ? String(gl.getParameter(known.UNMASKED_RENDERER_WEBGL)) : "";
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** Resolution of drawings: as fine as this machine can while things move, and finer at rest. */
class Quality {
  readonly #renderer: WebGLRenderer;
  readonly #redraw: () => void;
  /** Twice as fine at rest where edges are not smoothed otherwise. */
  readonly #finest: number;
  #moving: number;
  #ratio = 0;
  #mean = 25;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #resting = false;

  constructor(renderer: WebGLRenderer, software: boolean, redraw: () => void) {
    this.#renderer = renderer;
    this.#redraw = redraw;
    this.#moving = software ? 1 : this.#screen;
    this.#finest = software ? 2 : 1;
  }

  get #screen(): number {
    return Math.min(devicePixelRatio, 2);
  }

  /** Call before a drawing. since: milliseconds after the last. */
  drawing(since: number): void {
    if (!this.#resting) {
      if (since < REST) this.#judge(since);
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#rest(), REST);
    }
    // Tells tests that nothing has moved since that drawing.
    const { domElement, info } = this.#renderer;
    if (this.#resting) domElement.dataset["rest"] = String(info.render.frame);
    else delete domElement.dataset["rest"];
    this.#use(this.#resting ? Math.max(this.#screen, this.#finest) : this.#moving);
    this.#resting = false;
  }

  #rest(): void {
    this.#resting = true;
    this.#redraw();
  }

  #judge(since: number): void {
    this.#mean += 0.15 * (Math.min(since, 150) - this.#mean);
    if (this.#mean > SLOW && this.#moving > COARSEST) this.#change(0.8);
    else if (this.#mean < FAST && this.#moving < this.#screen) this.#change(1.1);
  }

  #change(factor: number): void {
    this.#moving = Math.min(this.#screen, Math.max(COARSEST, this.#moving * factor));
    this.#mean = (SLOW + FAST) / 2;
  }

  #use(ratio: number): void {
    if (Math.abs(ratio - this.#ratio) < 0.01) return;
    this.#ratio = ratio;
    this.#renderer.setPixelRatio(ratio);
  }
}
