/** Client of a posefield service: what the contract says, as types, promises and typed arrays. */

export { type ArchiveOptions, Client, type ClientOptions } from "./client.ts";
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
export type {
  Archive,
  ArchiveFormat,
  ClipFormat,
  ClipQuestion,
  CrowdFormat,
  CrowdPoses,
  CrowdQuestion,
  Download,
  ManifestEntry,
  ModelCard,
  ModelSummary,
  Motion,
  NamedClipQuestion,
  OnProgress,
  PoseQuestion,
  Poses,
  Progress,
  Readiness,
  Reasons,
  SigmaGrid,
  SigmaQuestion,
  Suggestions,
  Transfer,
  TransferOptions,
  Trust,
  WalkQuestion,
  WhyQuestion,
} from "./types.ts";
