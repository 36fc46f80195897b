/**
 * A crowd whose poses the graphics card computes from the model file, in browsers with WebGPU.
 *
 * The script that does it (webgpu/) is loaded from beside the page, and draws on a canvas over the
 * stage.
 */

import { Color, Group, Matrix4 } from "three";

import { type ComputedMotions, computedMotions } from "./crowd-library.ts";
import type { CrowdDrawing } from "./crowd-mesh.ts";
import type { Crowd } from "./crowd-walk.ts";
import { served } from "./page.ts";
import type { Scene } from "./scene.ts";
import type { Session } from "./session.ts";
import type { Drawing } from "./webgpu/crowd.ts";

const SCRIPT = "/crowd-webgpu.js";
/** Numbers of a character in the script's memory. */
const BODY = 8;
/** A height, m, that nothing is below. */
const NOWHERE = -1e6;

/** Motions, and who draws them. */
export interface ComputedCrowd {
  readonly motions: ComputedMotions;
  readonly drawing: WebGpuCrowd;
}

/**
 * Opens a graphics card and computes motions; null where the page has no service, the browser no
 * WebGPU, or no graphics card that can do it.
 *
 * most: characters. lost: called when the graphics card is lost.
 */
export async function open(
  session: Session,
  progress: (share: number) => void,
  most: number,
  lost: () => void,
): Promise<ComputedCrowd | null> {
  // Where a processor draws, it computes poses more slowly than the service does.
  const fit = served(session.source) && !session.scene.software;
  const device = fit ? await opened() : null;
  if (!device) return null;
  try {
    const made = await computed(session, device, progress, most);
    void device.lost.then(({ reason }) => reason === "destroyed" || lost());
    return made;
  } catch {
    // WebGL draws the crowd then, or says what is wrong with the service.
    device.destroy();
    return null;
  }
}

async function opened(): Promise<GPUDevice | null> {
  try {
    const adapter = await navigator.gpu?.requestAdapter();
    return (await adapter?.requestDevice()) ?? null;
  } catch {
    return null;
  }
}

async function computed(
  { source, store, card, signal, scene, character }: Session,
  device: GPUDevice,
  progress: (share: number) => void,
  most: number,
): Promise<ComputedCrowd> {
  const { model } = store.state;
  if (!served(source)) throw new Error("a page without a service has no kernel table");
  const [script, { content: table }, motions] = await Promise.all([
    import(/* @vite-ignore */ SCRIPT) as Promise<typeof import("./webgpu/chunk.ts")>,
    source.kernel(model, signal),
    computedMotions(source, model, card, signal, progress),
  ]);
  const canvas = document.createElement("canvas");
  canvas.setAttribute("aria-hidden", "true");
  const drawing = await script.Drawing.open(device, {
    ...{ table, motions: motions.points, most, canvas },
    skin: character,
  });
  return { motions, drawing: new WebGpuCrowd(drawing, device, scene, canvas, most) };
}

export class WebGpuCrowd implements CrowdDrawing {
  readonly group = new Group();
  readonly canvas: HTMLCanvasElement;
  readonly #drawing: Drawing;
  readonly #device: GPUDevice;
  readonly #scene: Scene;
  readonly #near: Float32Array<ArrayBuffer>;
  readonly #far: Float32Array<ArrayBuffer>;
  readonly #counts = { near: 0, far: 0 };
  readonly #matrix = new Matrix4();

  constructor(
    drawing: Drawing,
    device: GPUDevice,
    scene: Scene,
    canvas: HTMLCanvasElement,
    most: number,
  ) {
    this.#drawing = drawing;
    this.#device = device;
    this.#scene = scene;
    this.canvas = canvas;
    this.#near = new Float32Array(BODY * most);
    this.#far = new Float32Array(BODY * most);
  }

  paint(colours: readonly string[]): void {
    const linear = colours.flatMap((colour) => [...new Color(colour).toArray(), 1]);
    this.#drawing.paint(linear);
  }

  begin(): void {
    this.#counts.near = 0;
    this.#counts.far = 0;
  }

  add(near: boolean, crowd: Crowd, i: number): void {
    const kind = near ? "near" : "far";
    const numbers = near ? this.#near : this.#far;
    crowd.embody(numbers, BODY * this.#counts[kind], i);
    this.#counts[kind]++;
  }

  end(): void {
    const { camera, renderer, floor } = this.#scene;
    const { width, height } = renderer.domElement;
    const view = {
      matrix: this.#matrix.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)
        .elements,
      // From above, what is below the ground is hidden by it.
      ground: camera.position.y > floor ? floor : NOWHERE,
      width,
      height,
    };
    const own = (numbers: Float32Array<ArrayBuffer>, count: number) =>
      numbers.subarray(0, BODY * count);
    this.#drawing.draw(own(this.#near, this.#counts.near), own(this.#far, this.#counts.far), view);
  }

  dispose(): void {
    this.#drawing.dispose();
    this.#device.destroy();
  }
}
