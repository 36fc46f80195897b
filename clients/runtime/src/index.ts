/** Poses, clips and walkers of a posefield model, computed here by onnxruntime-web. */

export type { ModelCard } from "./card.ts";
export type { Clip, ClipOptions, Stance } from "./clip.ts";
export { InvalidField, ModelError, RuntimeFault } from "./errors.ts";
export { type Controls, type LoadOptions, load, Model, type Options, type Poses } from "./model.ts";
export type { Onnxruntime } from "./session.ts";
export type { Steering, Walkers } from "./walker.ts";
