/** The kernel on a device: its table, the motions, and the matrices that it writes. */

import source from "./kernel.wgsl";
import { BODY, type Layout, layout, read } from "./table.ts";

/** Bytes of a row of four numbers. */
const ROW = 16;

export interface KernelOptions {
  /** Of the model, as the service gives it. */
  readonly table: Uint8Array;
  /** Controls and weights of labels of each motion. */
  readonly motions: Float32Array<ArrayBuffer>;
  /** Characters at most. */
  readonly most: number;
  /** Whether `stages` receives the memory of each workgroup. */
  readonly dumped?: boolean;
}

export class Kernel {
  readonly layout: Layout;
  readonly bodies: GPUBuffer;
  /** Three rows of four numbers of each joint of each character. */
  readonly matrices: GPUBuffer;
  readonly stages: GPUBuffer;
  readonly #device: GPUDevice;
  readonly #pipeline: GPUComputePipeline;
  readonly #group: GPUBindGroup;
  readonly #own: readonly GPUBuffer[];

  /** Fails where the device has not the memory, or cannot read the kernel. */
  static async open(device: GPUDevice, options: KernelOptions): Promise<Kernel> {
    const table = read(options.table);
    const own = layout(table);
    const module = device.createShaderModule({ code: own.text + source });
    const pipeline = await device.createComputePipelineAsync({
      layout: "auto",
      compute: { module, constants: { DUMPED: Number(options.dumped ?? false) } },
    });
    return new Kernel(device, pipeline, own, table.numbers, options);
  }

  private constructor(
    device: GPUDevice,
    pipeline: GPUComputePipeline,
    own: Layout,
    numbers: Float32Array<ArrayBuffer>,
    { motions, most, dumped }: KernelOptions,
  ) {
    this.layout = own;
    this.#device = device;
    this.#pipeline = pipeline;
    const buffer = (size: number, usage: number) =>
      device.createBuffer({ size, usage: usage | GPUBufferUsage.STORAGE });
    const filled = (own: Float32Array<ArrayBuffer>) => {
      const made = buffer(Math.max(ROW, own.byteLength), GPUBufferUsage.COPY_DST);
      device.queue.writeBuffer(made, 0, own);
      return made;
    };
    this.bodies = buffer(4 * BODY * most, GPUBufferUsage.COPY_DST);
    this.matrices = buffer(3 * ROW * own.joints * most, GPUBufferUsage.COPY_SRC);
    this.stages = buffer(dumped ? 4 * own.scratch * most : ROW, GPUBufferUsage.COPY_SRC);
    this.#own = [filled(numbers), filled(motions), this.bodies, this.matrices, this.stages];
    this.#group = device.createBindGroup({
      layout: pipeline.getBindGroupLayout(0),
      entries: this.#own.map((buffer, binding) => ({ binding, resource: { buffer } })),
    });
  }

  /** Computes the first `count` of the bodies. */
  encode(encoder: GPUCommandEncoder, count: number): void {
    const pass = encoder.beginComputePass();
    pass.setPipeline(this.#pipeline);
    pass.setBindGroup(0, this.#group);
    pass.dispatchWorkgroups(count);
    pass.end();
  }

  /** The first numbers of a buffer of this kernel; waits for the device. */
  async numbers(from: GPUBuffer, count: number): Promise<Float32Array> {
    const usage = GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST;
    const copy = this.#device.createBuffer({ size: 4 * count, usage });
    const encoder = this.#device.createCommandEncoder();
    encoder.copyBufferToBuffer(from, 0, copy, 0, 4 * count);
    this.#device.queue.submit([encoder.finish()]);
    await copy.mapAsync(GPUMapMode.READ);
    const found = new Float32Array(copy.getMappedRange().slice(0));
    copy.destroy();
    return found;
  }

  dispose(): void {
    for (const buffer of this.#own) buffer.destroy();
  }
}
