/** The part that a page without a service loads: onnxruntime-web and what asks it. */

import * as ort from "onnxruntime-web/wasm";

import type { Source } from "../page.ts";
import { Offline } from "./source.ts";

/** A model file as a source of answers; what onnxruntime-web needs lies beside this script. */
export async function open(model: string, identity: string): Promise<Source> {
  ort.env.wasm.numThreads = 1;
  const beside = (name: string) => new URL(/* @vite-ignore */ name, import.meta.url).href;
  const [mjs, wasm] = ["ort-wasm-simd-threaded.mjs", "ort-wasm-simd-threaded.wasm"].map(beside);
  ort.env.wasm.wasmPaths = { mjs: mjs!, wasm: wasm! };
  const answer = await fetch(model);
  if (!answer.ok) throw new Error(`${model}: status ${answer.status}, expected a model file`);
  return new Offline(ort, new Uint8Array(await answer.arrayBuffer()), identity);
}
