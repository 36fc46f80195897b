/** Scripts of performances, built segment by segment. */

import { WrongQuestion } from "./errors.ts";
import type {
  ActSegment,
  HoldSegment,
  NamedScript,
  PerformanceQuestion,
  Segment,
  WalkSegment,
} from "./types.ts";

export type WalkOptions = Omit<WalkSegment, "kind" | "model">;
export type ActOptions = Omit<ActSegment, "kind" | "model">;
export type HoldOptions = Omit<HoldSegment, "kind" | "seconds">;
/** Options of a performance besides its segments. */
export type PerformanceOptions = Omit<PerformanceQuestion, "segments">;

/**
 * Segments of a performance, in order; every method returns a longer script.
 *
 * Metres, seconds, radians; points of the floor are x to the left and z forward.
 */
export class Script {
  readonly segments: readonly Segment[];

  constructor(segments: readonly Segment[] = []) {
    this.segments = segments;
  }

  /**
   * A walk along a curve through points, to a point, or for some seconds; with none of them it goes
   * where the act after it begins. Without a model, that of the walk before walks on.
   */
  walk(model: string, options?: WalkOptions): Script;
  walk(options: WalkOptions): Script;
  walk(first: string | WalkOptions, second: WalkOptions = {}): Script {
    const [model, options] = typeof first === "string" ? [first, second] : [this.#walker(), first];
    return this.#with({ kind: "walk", model, ...options });
  }

  /** A motion of a model without cycle, such as a reach or a kick. */
  act(model: string, options: ActOptions = {}): Script {
    return this.#with({ kind: "act", model, ...options });
  }

  /** Seconds in which the character stays as it is, after an act at its event. */
  hold(seconds: number, options: HoldOptions = {}): Script {
    return this.#with({ kind: "hold", seconds, ...options });
  }

  /** The question that a client sends, and that files of scripts contain. */
  question(options: PerformanceOptions = {}): PerformanceQuestion {
    return { segments: this.segments, ...options };
  }

  #with(segment: Segment): Script {
    return new Script([...this.segments, segment]);
  }

  #walker(): string {
    const walk = this.segments.filter((segment) => segment.kind === "walk").at(-1);
    if (walk) return walk.model;
    throw new WrongQuestion("a walk without a model, expected one in the first walk");
  }
}

/** The question of a script. */
export function scriptQuestion(script: Script | NamedScript): NamedScript {
  return script instanceof Script ? script.question() : script;
}
