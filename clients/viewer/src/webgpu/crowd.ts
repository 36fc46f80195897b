/** A crowd whose poses the graphics card computes from the model, and draws as instances. */

import source from "./draw.wgsl";
import { Kernel, type KernelOptions } from "./kernel.ts";
import { BODY, LEVEL_AT, MOST_LEVELS } from "./table.ts";

/** A skin: V points with up to four joints each, and the corners of fine and coarse triangles. */
export interface Skin {
  readonly points: Float32Array;
  readonly normals: Float32Array;
  readonly joints: Uint8Array | Uint16Array;
  readonly weights: Uint8Array;
  readonly fine: Uint8Array | Uint16Array | Uint32Array;
  readonly coarse: Uint8Array | Uint16Array | Uint32Array;
}

export interface View {
  /** Projection times camera, column by column, for depths from -1 to 1. */
  readonly matrix: ArrayLike<number>;
  /** Height of the ground, m, below which nothing shows. */
  readonly ground: number;
  /** Size of the picture, pixels. */
  readonly width: number;
  readonly height: number;
}

/** Numbers of the view in the shader: matrix, ground in a row of four, colours. */
const VIEW = 16 + 4 + 4 * MOST_LEVELS;
const DEPTH = "depth24plus";
/** Of a pixel, which smooth edges. */
const SAMPLES = 4;

/** Corners of triangles and how many joints move their points. */
interface Part {
  readonly pipeline: GPURenderPipeline;
  readonly group: GPUBindGroup;
  readonly index: GPUBuffer;
  readonly corners: number;
}

export interface CrowdOptions extends Omit<KernelOptions, "dumped"> {
  readonly canvas: HTMLCanvasElement;
  readonly skin: Skin;
}

export class Drawing {
  readonly #device: GPUDevice;
  readonly #kernel: Kernel;
  readonly #options: CrowdOptions;
  readonly #context: GPUCanvasContext;
  readonly #view: GPUBuffer;
  readonly #skin: readonly GPUBuffer[];
  readonly #parts: readonly Part[];
  readonly #numbers = new Float32Array(VIEW);
  readonly #format: GPUTextureFormat;
  /** Depths and colours before edges are smoothed. */
  #targets: readonly GPUTexture[] = [];

  /** Fails where the device cannot do it. */
  static async open(device: GPUDevice, options: CrowdOptions): Promise<Drawing> {
    const kernel = await Kernel.open(device, options);
    const { joints } = kernel.layout;
    const constants = { JOINTS: joints, BODY, LEVEL_AT, MOST_LEVELS };
    const text = Object.entries(constants).map(([name, value]) => `const ${name} = ${value}u;`);
    const module = device.createShaderModule({ code: text.join("\n") + source });
    const wide = options.skin.joints.BYTES_PER_ELEMENT === 1 ? "uint8x4" : "uint16x4";
    const formats = ["float32x3", "float32x3", wide, "unorm8x4"] as const;
    const strides = [12, 12, 4 * options.skin.joints.BYTES_PER_ELEMENT, 4];
    const buffers = formats.map((format, shaderLocation) => ({
      arrayStride: strides[shaderLocation]!,
      attributes: [{ format, shaderLocation, offset: 0 }],
    }));
    const format = navigator.gpu.getPreferredCanvasFormat();
    const pipeline = (influences: number) =>
      device.createRenderPipelineAsync({
        layout: "auto",
        vertex: { module, buffers, constants: { INFLUENCES: influences } },
        fragment: { module, targets: [{ format }] },
        primitive: { cullMode: "back" },
        depthStencil: { format: DEPTH, depthWriteEnabled: true, depthCompare: "less" },
        multisample: { count: SAMPLES },
      });
    const pipelines = await Promise.all([pipeline(4), pipeline(1)]);
    return new Drawing(device, kernel, pipelines, format, options);
  }

  private constructor(
    device: GPUDevice,
    kernel: Kernel,
    pipelines: readonly GPURenderPipeline[],
    format: GPUTextureFormat,
    options: CrowdOptions,
  ) {
    this.#device = device;
    this.#kernel = kernel;
    this.#options = options;
    this.#format = format;
    this.#context = options.canvas.getContext("webgpu")!;
    this.#context.configure({ device, format, alphaMode: "premultiplied" });
    const { points, normals, joints, weights, fine, coarse } = options.skin;
    const filled = (own: ArrayBufferView<ArrayBufferLike>, usage: number) => {
      const size = 4 * Math.ceil(own.byteLength / 4);
      const bytes = new Uint8Array(size);
      bytes.set(new Uint8Array(own.buffer, own.byteOffset, own.byteLength));
      const made = device.createBuffer({ size, usage: usage | GPUBufferUsage.COPY_DST });
      device.queue.writeBuffer(made, 0, bytes);
      return made;
    };
    this.#view = filled(this.#numbers, GPUBufferUsage.UNIFORM);
    this.#skin = [points, normals, joints, weights].map((own) =>
      filled(own, GPUBufferUsage.VERTEX),
    );
    const buffers = [this.#view, kernel.matrices, kernel.bodies];
    this.#parts = [fine, coarse].map((corners, i) => ({
      pipeline: pipelines[i]!,
      group: device.createBindGroup({
        layout: pipelines[i]!.getBindGroupLayout(0),
        entries: buffers.map((buffer, binding) => ({ binding, resource: { buffer } })),
      }),
      index: filled(Uint32Array.from(corners), GPUBufferUsage.INDEX),
      corners: corners.length,
    }));
  }

  /** Colours of the levels: red, green, blue and one, linear. */
  paint(tints: ArrayLike<number>): void {
    this.#numbers.set(tints, 20);
  }

  /** Draws characters: those in `near` with all triangles, those in `far` with few. */
  draw(near: Float32Array<ArrayBuffer>, far: Float32Array<ArrayBuffer>, view: View): void {
    const { queue } = this.#device;
    const counts = [near.length / BODY, far.length / BODY];
    queue.writeBuffer(this.#kernel.bodies, 0, near);
    queue.writeBuffer(this.#kernel.bodies, near.byteLength, far);
    this.#numbers.set(view.matrix);
    this.#numbers[16] = view.ground;
    queue.writeBuffer(this.#view, 0, this.#numbers);
    const encoder = this.#device.createCommandEncoder();
    const all = counts[0]! + counts[1]!;
    if (all) this.#kernel.encode(encoder, all);
    const pass = encoder.beginRenderPass(this.#pass(view));
    this.#skin.forEach((buffer, slot) => void pass.setVertexBuffer(slot, buffer));
    let first = 0;
    this.#parts.forEach(({ pipeline, group, index, corners }, i) => {
      if (!counts[i]) return;
      pass.setPipeline(pipeline);
      pass.setBindGroup(0, group);
      pass.setIndexBuffer(index, "uint32");
      pass.drawIndexed(corners, counts[i], 0, 0, first);
      first += counts[i];
    });
    pass.end();
    queue.submit([encoder.finish()]);
  }

  #pass({ width, height }: View): GPURenderPassDescriptor {
    const { canvas } = this.#options;
    if (canvas.width !== width || canvas.height !== height || !this.#targets.length) {
      Object.assign(canvas, { width, height });
      for (const texture of this.#targets) texture.destroy();
      const [size, usage] = [[width, height], GPUTextureUsage.RENDER_ATTACHMENT];
      this.#targets = ([DEPTH, this.#format] as const).map((format) =>
        this.#device.createTexture({ size, usage, format, sampleCount: SAMPLES }),
      );
    }
    const [depth, colour] = this.#targets.map((texture) => texture.createView());
    return {
      colorAttachments: [
        {
          view: colour!,
          resolveTarget: this.#context.getCurrentTexture().createView(),
          loadOp: "clear",
          storeOp: "discard",
          clearValue: [0, 0, 0, 0],
        },
      ],
      depthStencilAttachment: {
        view: depth!,
        depthClearValue: 1,
        depthLoadOp: "clear",
        depthStoreOp: "discard",
      },
    };
  }

  dispose(): void {
    this.#kernel.dispose();
    for (const buffer of [this.#view, ...this.#skin, ...this.#parts.map(({ index }) => index)])
      buffer.destroy();
    for (const texture of this.#targets) texture.destroy();
    this.#context.unconfigure();
  }
}
