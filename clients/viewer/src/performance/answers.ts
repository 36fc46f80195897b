/** What a service answers to a script: its plan, its motion, or a file. */

import { PosefieldError, Problem } from "@posefield/client";

import type { Source } from "../page.ts";
import type { Track } from "../playback.ts";
import type { Service } from "../service.ts";
import type { Note } from "./timeline.ts";

export interface Report {
  readonly character: string;
  readonly duration: number;
  readonly sigma: number;
  readonly supported: boolean;
  readonly segments: readonly {
    readonly kind: string;
    readonly model: string;
    readonly begins: number;
    readonly ends: number;
    readonly place: readonly [number, number];
    readonly heading: number;
    readonly event?: number;
    readonly targets?: readonly {
      readonly what: string;
      readonly miss: number;
      readonly reached: boolean;
    }[];
  }[];
  readonly joins: readonly {
    readonly segment: number;
    readonly time: number;
    readonly distance: number;
    readonly blend: string;
    readonly seconds: number;
    readonly peak: number;
    readonly usual: number;
    readonly hard: boolean;
  }[];
  readonly feet?: {
    readonly stances: readonly {
      readonly joint: string;
      readonly begin: number;
      readonly end: number;
    }[];
  };
  readonly warnings: readonly { readonly pointer: string; readonly message: string }[];
}

/** A whole motion: its frames, its bones (J × 3, m) and its joints. */
export interface Performed {
  readonly report: Report;
  readonly track: Track;
  readonly offsets: Float32Array;
  readonly names: readonly string[];
  readonly parents: readonly number[];
}

interface Document {
  readonly trust: Report;
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly rate: number;
  readonly times: readonly number[];
  readonly rotations: readonly (readonly (readonly number[])[])[];
  readonly root_position: readonly (readonly number[])[];
  readonly bone_offsets: readonly (readonly number[])[];
}

/** Who answers scripts; a page without a service has nobody. */
export type Stage = Pick<Service, "post">;

export function staged(source: Source): (Source & Stage) | null {
  return "post" in source ? (source as Source & Stage) : null;
}

export async function plan(stage: Stage, script: string, signal: AbortSignal): Promise<Report> {
  const answer = await stage.post("/v1/performances.json?plan=true", script, signal);
  return ((await answer.json()) as Document).trust;
}

export async function perform(
  stage: Stage,
  script: string,
  signal: AbortSignal,
): Promise<Performed> {
  const answer = await stage.post("/v1/performances.json", script, signal);
  return performed((await answer.json()) as Document);
}

export async function file(
  stage: Stage,
  format: string,
  script: string,
  signal: AbortSignal,
): Promise<Blob> {
  return (await stage.post(`/v1/performances.${format}`, script, signal)).blob();
}

export function performed(found: Document): Performed {
  const { names, parents, rate, trust } = found;
  const track = {
    rate,
    times: Float64Array.from(found.times),
    rotations: Float32Array.from(found.rotations.flat(2)),
    rootPosition: Float32Array.from(found.root_position.flat()),
  };
  const offsets = Float32Array.from(found.bone_offsets.flat());
  return { report: trust, track, offsets, names, parents };
}

/** Faults of the script by their places; null where the fault is not the script's. */
export function faultsOf(fault: unknown): readonly Note[] | null {
  if (!(fault instanceof PosefieldError)) return null;
  if (!(fault instanceof Problem)) return null;
  if ([401, 403, 429].includes(fault.status) || fault.status >= 500) return null;
  if (fault.kind === "no-such-path") return [note("", OLDER)];
  const placed = fault.places.filter(({ pointer }) => pointer !== undefined);
  if (!placed.length) return [note("", fault.message)];
  return placed.map(({ pointer, detail }) => note(pointer!, detail || fault.message));
}

const OLDER = "This service is older than performances: it answers clips of one model alone.";

function note(pointer: string, words: string): Note {
  return { pointer, words, fault: true };
}
