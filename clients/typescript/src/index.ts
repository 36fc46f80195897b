/** Client of a posefield service: what the contract says, as types, promises and typed arrays. */

export { Client, type ClientOptions } from "./client.ts";
export {
  Broken,
  type Place,
  PosefieldError,
  Problem,
  type ProblemKind,
  TimedOut,
  Unexpected,
  Unreachable,
  WrongQuestion,
} from "./errors.ts";
export { CONTRACT } from "./schema.ts";
export {
  type ActOptions,
  type HoldOptions,
  type PerformanceOptions,
  Script,
  type WalkOptions,
} from "./scripts.ts";
export type * from "./types.ts";
