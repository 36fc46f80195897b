/** The kernel of the page's crowd beside the graph of the model, stage by stage, at all levels. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { dirname, join } from "node:path";
import { after, before, describe, it } from "node:test";

import type { ModelCard } from "@posefield/client";
import type { Browser, Page } from "playwright-core";

import { standing } from "../src/character.ts";
import { COVARIANCES, read } from "../src/webgpu/table.ts";
import { browserWithWebGpu, opened, SERVICE } from "./harness.ts";
import { COMMAND, MODELS } from "./static.ts";

/** Questions a model. */
const COUNT = 24;
/** Metres that a joint may be away from the service's. */
const PLACES = 1e-4;
/** Of the largest number of a stage, by which another may differ from the graph's. */
const SHARE = 3e-5;
/** Bytes of the script as it travels. */
const BUDGET = 12_000;

/** Arrays of the table, and the stages that they change. */
const SPOILT: Readonly<Record<string, readonly string[]>> = {
  control_scales: ["basis"],
  weights_1: ["values", "duration"],
  warp_form: ["frame"],
  core_1: ["motion"],
  time_1: ["time", "moves"],
  pose_1: ["numbers"],
  mean_rotations: ["quaternions"],
  offset_mean: ["bones", "places"],
};

type Rows = readonly (readonly number[])[];

/** Of kernel_stages.py: questions, the graph's stages and the service's answers at each level. */
interface Expected {
  readonly controls: Rows;
  readonly labels: Rows;
  readonly times: Rows;
  readonly levels: readonly Readonly<Record<string, Rows>>[];
  readonly answers: readonly Rows[];
  /** By their names, at the squared scaled distances 0, 1/16, 2/16 ... below 4. */
  readonly covariances: Readonly<Record<string, readonly number[]>>;
}

interface Asked {
  readonly model: string;
  readonly level: number;
  readonly motions: readonly number[];
  readonly times: readonly number[];
  /** Cosine and sine of half the heading, and x and z. */
  readonly standing?: readonly number[];
  /** An array of the table to be multiplied by a factor, by default a hundredth larger. */
  readonly spoilt?: string;
  readonly factor?: number;
  /** A chart of rotations that the table then names. */
  readonly chart?: string;
}

/** What the page's script exports, as far as it is used here. */
type Chunk = typeof import("../src/webgpu/chunk.ts");

function graph(model: string): Expected {
  const python = join(dirname(COMMAND), "python");
  const script = new URL("kernel_stages.py", import.meta.url).pathname;
  const words = [script, join(MODELS, `${model}.onnx`), String(COUNT)];
  return JSON.parse(execFileSync(python, words, { maxBuffer: 1 << 28 }).toString()) as Expected;
}

/** In the page: the kernel's memory after the questions, by stage, and the matrices. */
async function computed(asked: Asked): Promise<{
  stages: Record<string, number[][]>;
  matrices: number[];
  faults: string[];
}> {
  const chunk = (await import("/crowd-webgpu.js" as string)) as Chunk;
  const answer = await fetch(`/v1/models/${asked.model}/kernel.safetensors`);
  let table = new Uint8Array(await answer.arrayBuffer());
  const size = Number(new DataView(table.buffer).getBigUint64(0, true));
  const text = new TextDecoder().decode(table.subarray(8, 8 + size));
  if (asked.spoilt) {
    const [from, to] = JSON.parse(text)[asked.spoilt].data_offsets as [number, number];
    const numbers = new Float32Array(table.buffer, 8 + size + from, (to - from) / 4);
    numbers.set(numbers.map((value) => (asked.factor ?? 1.01) * value));
  }
  if (asked.chart) {
    const said = text.replace(/"chart":"\w+"/, `"chart":"${asked.chart}"`).trimEnd();
    const header = new TextEncoder().encode(said.padEnd(8 * Math.ceil(said.length / 8)));
    const length = new Uint8Array(new BigUint64Array([BigInt(header.length)]).buffer);
    const parts = [length, header, table.subarray(8 + size)];
    table = new Uint8Array(await new Blob(parts).arrayBuffer());
  }
  const device = await (await navigator.gpu.requestAdapter())!.requestDevice();
  const faults: string[] = [];
  device.addEventListener("uncapturederror", ({ error }) => faults.push(error.message));
  const most = asked.times.length;
  const motions = Float32Array.from(asked.motions);
  const kernel = await chunk.Kernel.open(device, { table, motions, most, dumped: true });
  const standing = asked.standing ?? [1, 0, 0, 0];
  const bodies = asked.times.flatMap((time, i) => [...standing, time, asked.level, i, 0]);
  device.queue.writeBuffer(kernel.bodies, 0, Float32Array.from(bodies));
  const encoder = device.createCommandEncoder();
  kernel.encode(encoder, most);
  device.queue.submit([encoder.finish()]);
  const { scratch, stages, joints } = kernel.layout;
  const found = await kernel.numbers(kernel.stages, scratch * most);
  const matrices = await kernel.numbers(kernel.matrices, 12 * joints * most);
  const cut = ([at, size]: readonly [number, number]) =>
    asked.times.map((_, i) => [...found.subarray(i * scratch + at, i * scratch + at + size)]);
  const named = Object.entries(stages).map(([name, place]) => [name, cut(place)] as const);
  device.destroy();
  return { stages: Object.fromEntries(named), matrices: [...matrices], faults };
}

/** In the page: a covariance of the kernel at 64 squared scaled distances. */
async function correlated(formula: string): Promise<number[]> {
  const device = await (await navigator.gpu.requestAdapter())!.requestDevice();
  const code = `@group(0) @binding(0) var<storage, read_write> found: array<f32>;
    fn covariance(s: f32) -> f32 { let a = sqrt(s); return ${formula}; }
    @compute @workgroup_size(64)
    fn every(@builtin(local_invocation_index) i: u32) { found[i] = covariance(f32(i) / 16.0); }`;
  const compute = { module: device.createShaderModule({ code }) };
  const pipeline = await device.createComputePipelineAsync({ layout: "auto", compute });
  const [size, storage] = [256, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC];
  const buffer = device.createBuffer({ size, usage: storage });
  const usage = GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST;
  const copy = device.createBuffer({ size, usage });
  const layout = pipeline.getBindGroupLayout(0);
  const encoder = device.createCommandEncoder();
  const pass = encoder.beginComputePass();
  pass.setPipeline(pipeline);
  pass.setBindGroup(
    0,
    device.createBindGroup({ layout, entries: [{ binding: 0, resource: { buffer } }] }),
  );
  pass.dispatchWorkgroups(1);
  pass.end();
  encoder.copyBufferToBuffer(buffer, 0, copy, 0, size);
  device.queue.submit([encoder.finish()]);
  await copy.mapAsync(GPUMapMode.READ);
  const found = [...new Float32Array(copy.getMappedRange())];
  device.destroy();
  return found;
}

/** Largest difference of the numbers of a stage; those that a coarse level has not are left out. */
function apart(expected: Rows, found: Rows): number {
  return Math.max(
    ...expected.flatMap((row, i) => row.map((value, k) => Math.abs(value - found[i]![k]!))),
  );
}

function allowed(name: string, expected: Rows): number {
  return name === "places" ? PLACES : SHARE * Math.max(1, ...expected.flat().map(Math.abs));
}

for (const model of ["cmu_walk", "reaching"])
  describe(`the kernel of ${model}`, () => {
    let from: Browser;
    let page: Page;
    let expected: Expected;

    before(async () => {
      from = await browserWithWebGpu();
      ({ page } = await opened(from));
      expected = graph(model);
    });
    after(() => from.close());

    function run(level: number, more: Partial<Asked> = {}) {
      const { controls, labels, times } = expected;
      const motions = controls.flatMap((own, i) => [...own, ...labels[i]!]);
      const asked = { model, level, motions, times: times.map(([time]) => time!), ...more };
      return page.evaluate(computed, asked);
    }

    for (const level of [0, 1, 2, 3])
      it(`computes the stages of the graph at level ${level}`, async () => {
        const { stages, faults } = await run(level);
        assert.deepEqual(faults, []);
        for (const [name, values] of Object.entries(expected.levels[level]!)) {
          const off = apart(values, stages[name]!);
          assert.ok(off <= allowed(name, values), `${name}: ${off} apart`);
        }
        const off = apart(expected.answers[level]!, stages["places"]!);
        assert.ok(off <= PLACES, `joints are ${1000 * off} mm from those of the service`);
      });

    // Of one model, which takes long enough.
    if (model === "reaching") {
      it("knows rotation vectors too", async () => {
        const more = { chart: "rotation_vector", spoilt: "pose_1", factor: 8 } as const;
        const { stages } = await run(1, more);
        const answer = await fetch(`${SERVICE}/v1/models/${model}/kernel.safetensors`);
        const table = read(new Uint8Array(await answer.arrayBuffer()));
        const means = table.numbers.subarray(table.arrays["mean_rotations"]!.at);
        let largest = 0;
        const turned = stages["numbers"]!.map((row) => {
          const own = row.slice(3);
          return own.map((value, k) => {
            const angle = Math.hypot(...own.slice(k - (k % 4), k - (k % 4) + 4));
            largest = Math.max(largest, angle);
            return means[k]! * Math.cos(angle) + (value * Math.sin(angle)) / angle;
          });
        });
        assert.ok(largest > 2, `half angles up to ${largest} are computed`);
        assert.ok(apart(turned, stages["quaternions"]!) < 3e-6);
        // Negative control: the numbers in the other chart.
        const { stages: other } = await run(1, { spoilt: "pose_1", factor: 8 });
        assert.ok(apart(turned, other["quaternions"]!) > 0.1);
      });

      it("knows the covariances of all models", async () => {
        assert.deepEqual(Object.keys(COVARIANCES), Object.keys(expected.covariances));
        for (const [name, values] of Object.entries(expected.covariances)) {
          const found = await page.evaluate(correlated, COVARIANCES[name]!);
          assert.ok(apart([values], [found]) < 1e-6, name);
          // Negative control: those of the next distances.
          assert.ok(apart([values.slice(1)], [found]) > 1e-3, name);
        }
      });

      it("is found to be wrong at each stage where a number is wrong by a hundredth", async () => {
        for (const [spoilt, names] of Object.entries(SPOILT)) {
          const { stages } = await run(1, { spoilt });
          for (const name of names) {
            const values = expected.levels[1]![name]!;
            const off = apart(values, stages[name]!);
            assert.ok(off > allowed(name, values), `${name}: ${off} apart without ${spoilt}`);
          }
        }
      });
    }

    it("moves the skin to where characters stand", async () => {
      const card = (await (await fetch(`${SERVICE}/v1/models/${model}`)).json()) as ModelCard;
      const rest = standing(card, Float32Array.from(card.skeleton.offsets.flat()));
      const [heading, x, z] = [0.7, 3, -5] as const;
      const own = [Math.cos(heading / 2), Math.sin(heading / 2), x, z];
      const { matrices } = await run(1, { standing: own });
      const { places } = expected.levels[1]!;
      const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
      const there = places!.map((row) =>
        row.map((value, k) => {
          const [px, pz] = [row[k - (k % 3)]!, row[k - (k % 3) + 2]!];
          return [cos * px + sin * pz + x, value, cos * pz - sin * px + z][k % 3]!;
        }),
      );
      // A joint at rest is moved to where it is.
      const moved = places!.map((row, i) =>
        row.map((_, k) => {
          const at = 12 * ((i * row.length) / 3 + Math.floor(k / 3)) + 4 * (k % 3);
          const [a, b, c] = rest.subarray(k - (k % 3), k - (k % 3) + 3) as unknown as number[];
          const [p, q, r, shift] = matrices.slice(at, at + 4) as [number, number, number, number];
          return p * a! + q * b! + r * c! + shift;
        }),
      );
      assert.ok(apart(there, moved) < PLACES);
      // Negative control: characters that face elsewhere.
      assert.ok(apart(places!, moved) > 1);
    });
  });

it("travels in 12 kB", async () => {
  const answer = await fetch(`${SERVICE}/crowd-webgpu.js`, {
    headers: { "accept-encoding": "gzip" },
  });
  const content = await answer.arrayBuffer();
  const size = Number(answer.headers.get("content-length"));
  assert.equal(answer.headers.get("content-encoding"), "gzip");
  assert.ok(size < BUDGET && size < content.byteLength, `${size} bytes`);
});
