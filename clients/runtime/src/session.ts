/** Runs of parts of a model's graph in onnxruntime. */

import type { InferenceSession, Tensor, TensorConstructor } from "onnxruntime-web";
import type { ModelCard } from "./card.ts";
import { ModelError } from "./errors.ts";
import { selectOutputs } from "./onnx-file.ts";

/** Part of onnxruntime-web that is used, so that each of its builds will do. */
export interface Onnxruntime {
  readonly InferenceSession: {
    create(
      content: Uint8Array,
      options?: InferenceSession.SessionOptions,
    ): Promise<InferenceSession>;
  };
  readonly Tensor: TensorConstructor;
  readonly env: { readonly wasm: { numThreads?: number; proxy?: boolean } };
}

export interface Point {
  /** Controls in the order of the card, one row for each point. */
  readonly controls: readonly (readonly number[])[];
  /** Weights of the names of all label sets, shared by all points. */
  readonly labels: readonly number[];
  readonly level: number;
}

export class Session {
  readonly card: ModelCard;
  readonly #content: Uint8Array;
  readonly #ort: Onnxruntime;
  readonly #providers: readonly string[];
  readonly #parts = new Map<string, Promise<InferenceSession>>();

  constructor(
    content: Uint8Array,
    card: ModelCard,
    ort: Onnxruntime,
    providers: readonly string[],
  ) {
    this.#content = content;
    this.card = card;
    this.#ort = ort;
    this.#providers = providers;
  }

  /** Outputs of the graph by name, for points (B) within the sampled ranges and times (B × S), s. */
  async run<Name extends string>(
    { controls, labels, level }: Point,
    times: Float32Array | readonly number[],
    ...values: readonly Name[]
  ): Promise<Record<Name, Float32Array>> {
    const session = await this.#part(values, level);
    const rows = controls.length;
    const feeds: Record<string, Tensor> = {
      controls: this.#tensor(controls.flat(), [rows, this.card.controls.length]),
      time: this.#tensor(times, [rows, times.length / rows]),
    };
    if (labels.length) feeds["labels"] = this.#tensor(labels, [1, labels.length]);
    const inputs = Object.entries(feeds).filter(([name]) => session.inputNames.includes(name));
    const outputs = await session.run(Object.fromEntries(inputs));
    const arrays = values.map((name) => [name, outputs[name]!.data]);
    return Object.fromEntries(arrays) as Record<Name, Float32Array>;
  }

  #tensor(numbers: Float32Array | readonly number[], dims: readonly number[]): Tensor {
    return new this.#ort.Tensor("float32", Float32Array.from(numbers), dims);
  }

  #part(values: readonly string[], level: number): Promise<InferenceSession> {
    const key = `${level} ${values.join(" ")}`;
    const opened = this.#parts.get(key) ?? this.#open(values, level);
    this.#parts.set(key, opened);
    return opened;
  }

  async #open(values: readonly string[], level: number): Promise<InferenceSession> {
    const content = selectOutputs(this.#content, values, level);
    try {
      return await this.#ort.InferenceSession.create(content, {
        executionProviders: this.#providers,
        // Further optimisation takes as long as forty runs, and makes them no quicker.
        graphOptimizationLevel: "basic",
        logSeverityLevel: 3,
      });
    } catch (fault) {
      throw new ModelError(`onnxruntime cannot open the model: ${fault}`, { cause: fault });
    }
  }
}
