/** Client of a posefield service: what the contract says, as types, promises and typed arrays. */

export { Client, type ClientOptions, type Download } from "./client.ts";
export { PosefieldError, Problem, Unexpected, Unreachable } from "./errors.ts";
export type {
  ClipFormat,
  ClipQuestion,
  CrowdPoses,
  CrowdQuestion,
  ModelCard,
  ModelSummary,
  Motion,
  PoseQuestion,
  Poses,
  Reasons,
  SigmaGrid,
  SigmaQuestion,
  Trust,
  WhyQuestion,
} from "./types.ts";
