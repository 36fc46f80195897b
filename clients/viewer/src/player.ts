/** What the body does: asks for poses while something is dragged, then for the clip, and plays it. */

import type { ModelCard, Motion, Poses, Trust } from "@posefield/client";

import * as ask from "./ask.ts";
import { curvesAt } from "./curves.ts";
import { Latest } from "./latest.ts";
import type { Page } from "./page.ts";
import {
  advanced,
  after,
  type Carried,
  carried,
  NOWHERE,
  type Pose,
  pose,
  sample,
} from "./playback.ts";
import type { State } from "./state.ts";
import { Stopwatch } from "./stopwatch.ts";
import { TAKE_AND_FEET } from "./takes.ts";

/** Milliseconds without a change until the whole clip is worth asking for. */
const IDLE = 140;

/** A body in space: its pose, its bones (J × 3, m), and where laps have carried it. */
export interface Shown extends Pose {
  readonly offsets: Float32Array;
  readonly carried: Carried;
  /** Values of the card's curves; none where only a crowd's pose is known. */
  readonly curves?: Float32Array | null;
}

export type Watcher = (shown: Shown) => void;

export class Player {
  readonly #page: Page;
  readonly #stopwatch = new Stopwatch();
  readonly #watchers = new Set<Watcher>();
  readonly #trusted = new Set<(trust: Trust) => void>();
  readonly #clips = new Set<(clip: Motion) => void>();
  readonly #pose: Pose;
  readonly #poses = new Latest<number>((asked) => this.#askPose(asked));
  readonly #whole = new Latest<number>((asked) => this.#askClip(asked));
  #offsets: Float32Array;
  #curves: Float32Array | null = null;
  #clip: Motion | null = null;
  #lap: Carried = NOWHERE;
  #carried: Carried = NOWHERE;
  #asked = 0;
  #coming = new AbortController();
  #answered = 0;
  #idle: ReturnType<typeof setTimeout> | undefined;
  trust: Trust | null = null;

  constructor(page: Page) {
    this.#page = page;
    const { offsets } = page.card.skeleton;
    this.#offsets = Float32Array.from(offsets.flat());
    this.#pose = atRest(page.card);
    const leave = page.store.listen((state, changed) => this.#changed(state, changed));
    const stop = page.scene.add((seconds) => this.#step(seconds));
    page.signal.addEventListener("abort", () => {
      clearTimeout(this.#idle);
      leave();
      stop();
    });
  }

  /** The clip that plays; null while controls are on the move. */
  get clip(): Motion | null {
    return this.#clip;
  }

  get duration(): number {
    return this.trust?.duration ?? this.#page.card.durations[1] ?? 1;
  }

  get shown(): Shown {
    const [offsets, carried, curves] = [this.#offsets, this.#carried, this.#curves];
    return { ...this.#pose, offsets, carried, curves };
  }

  /** Called with every new pose that is shown, and once at the start. */
  watch(watcher: Watcher): void {
    this.#watchers.add(watcher);
    watcher(this.shown);
  }

  /** Called with what each answer says of itself. */
  onTrust(listener: (trust: Trust) => void): void {
    this.#trusted.add(listener);
    if (this.trust) listener(this.trust);
  }

  onClip(listener: (clip: Motion) => void): void {
    this.#clips.add(listener);
    if (this.#clip) listener(this.#clip);
  }

  /** Asks for a pose at once, and for the clip when nothing moves any more. */
  ask(): void {
    this.#next();
    this.#hold(null);
    this.#stopwatch.asked(this.#asked);
    this.#poses.ask(this.#asked);
    this.#soon(this.#answered ? IDLE : 0);
  }

  /** The body goes back to where its clip begins. */
  home(): void {
    this.#carried = NOWHERE;
  }

  /** What was asked before is not waited for any more, however slowly it comes. */
  #next(): void {
    this.#asked += 1;
    this.#coming.abort();
  }

  /** What is held is marked on the stage, for who tests the page. */
  #hold(clip: Motion | null): void {
    this.#clip = clip;
    document.querySelector("#stage")!.toggleAttribute("data-clip", clip !== null);
  }

  #soon(wait: number): void {
    clearTimeout(this.#idle);
    this.#idle = setTimeout(() => this.#whole.ask(this.#asked), wait);
  }

  #changed(state: State, changed: ReadonlySet<keyof State>): void {
    if (ASKED_ANEW.some((key) => changed.has(key))) this.ask();
    else if (REPLACED.some((key) => changed.has(key))) this.#replaced(changed);
    else if (changed.has("time") && !state.playing) this.#show(state.time);
    if (changed.has("playing") || changed.has("view")) this.#page.scene.redraw();
  }

  /** The same question's motion as another clip: what is shown goes on meanwhile. */
  #replaced(changed: ReadonlySet<keyof State>): void {
    // Another take goes on where the last one was.
    if (changed.has("loop") || changed.has("root")) this.home();
    this.#next();
    this.#soon(0);
  }

  async #askPose(asked: number): Promise<void> {
    const { card, source, store } = this.#page;
    const { duration } = this;
    const time = Math.min(store.state.time, duration);
    const question = ask.pose(source, card, store.state, time, duration, this.#page.signal);
    const answer = await this.#tried(question);
    if (!answer || asked < this.#answered) return;
    this.#pose.rotations.set(answer.rotations.subarray(0, this.#pose.rotations.length));
    this.#pose.root.set(answer.rootPosition.subarray(0, 3));
    this.#curves = answer.curves;
    this.#take(asked, answer);
    this.#told();
  }

  async #askClip(asked: number): Promise<void> {
    const { card, source, store } = this.#page;
    this.#coming = new AbortController();
    const signal = AbortSignal.any([this.#page.signal, this.#coming.signal]);
    const { loop, root } = store.state;
    const clip = await this.#tried(ask.clip(source, card, store.state, signal));
    if (!clip || asked !== this.#asked) return;
    this.#hold(clip);
    const travels = card.cyclic && loop && root === "travelling";
    this.#lap = travels ? carried(clip, card.skeleton.names.length) : NOWHERE;
    this.#take(asked, clip);
    this.#show(store.state.time);
    for (const listener of this.#clips) listener(clip);
  }

  /** null where there is no answer, or nobody wants it any more. */
  async #tried<Answer>(asked: Promise<Answer>): Promise<Answer | null> {
    const { notice, signal } = this.#page;
    try {
      const answer = await asked;
      if (!signal.aborted) notice(null);
      return signal.aborted ? null : answer;
    } catch (fault) {
      if (!signal.aborted) notice(fault);
      return null;
    }
  }

  #take(asked: number, answer: Poses): void {
    this.#answered = asked;
    this.#stopwatch.answered(asked);
    this.#offsets = answer.boneOffsets;
    this.trust = answer.trust;
    for (const listener of this.#trusted) listener(answer.trust);
    const { time } = this.#page.store.state;
    if (time > answer.trust.duration) this.#page.store.set({ time: answer.trust.duration });
  }

  #step(seconds: number): boolean {
    this.#stopwatch.drawn();
    const { loop, playing, speed, time, view } = this.#page.store.state;
    // A performance has a time of its own.
    if (!playing || !this.#clip || view === "performance") return false;
    const next = advanced(time, seconds * speed, this.duration, loop);
    for (let lap = 0; lap < Math.min(next.laps, 4); lap++)
      this.#carried = after(this.#carried, this.#lap);
    this.#show(next.time);
    this.#page.store.set({ time: next.time, playing: next.playing });
    return next.playing;
  }

  #show(time: number): void {
    if (!this.#clip) {
      this.#next();
      this.#poses.ask(this.#asked);
      this.#soon(IDLE);
      return;
    }
    sample(this.#pose, this.#clip, time);
    this.#curves = curvesAt(this.#clip, time);
    this.#told();
  }

  #told(): void {
    for (const watcher of this.#watchers) watcher(this.shown);
    this.#page.scene.redraw();
  }
}

const ASKED_ANEW = ["controls", "performer", "labels", "level"] as const;
const REPLACED = ["loop", "root", ...TAKE_AND_FEET] as const;

/** No joint turned, and as high as the legs are long. */
function atRest(card: ModelCard): Pose {
  const rest = pose(card.skeleton.names.length);
  for (let at = 0; at < rest.rotations.length; at += 4) rest.rotations[at] = 1;
  rest.root[1] = depth(card);
  return rest;
}

function depth({ skeleton }: ModelCard): number {
  const heights: number[] = [];
  skeleton.parents.forEach((parent, joint) => {
    heights.push(parent < 0 ? 0 : heights[parent]! + skeleton.offsets[joint]![1]!);
  });
  return -Math.min(...heights);
}
