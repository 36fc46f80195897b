/** The part that a page without a service loads: onnxruntime-web and what asks it. */

import * as ort from "onnxruntime-web/wasm";

import type { Source } from "../page.ts";
import { Offline, type Tables } from "./source.ts";

/**
 * A model as a source of answers; what onnxruntime-web needs lies beside this script.
 *
 * tables: address of the model's tables, beside which its graphs and its character lie.
 */
export async function open(tables: string): Promise<Source> {
  ort.env.wasm.numThreads = 1;
  const beside = (name: string) => new URL(/* @vite-ignore */ name, import.meta.url).href;
  const [mjs, wasm] = ["ort-wasm-simd-threaded.mjs", "ort-wasm-simd-threaded.wasm"].map(beside);
  ort.env.wasm.wasmPaths = { mjs: mjs!, wasm: wasm! };
  const read = (await (await got(tables)).json()) as Tables;
  const address = new URL(tables, document.baseURI);
  const file = async (name: string) => {
    const found = await got(new URL(name, address).href);
    return new Uint8Array(await found.arrayBuffer());
  };
  const level = (level: number) => file(`level-${level}.onnx`);
  return new Offline(ort, level, () => file("character.glb"), read);
}

async function got(address: string): Promise<Response> {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`${address}: status ${answer.status}, expected a file`);
  return answer;
}
