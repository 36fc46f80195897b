/** The body's motion: poses are asked for while something is dragged, then the clip, which plays. */

import type { ModelCard, Motion, Poses, Trust } from "@posefield/client";

import { Latest } from "./latest.ts";
import type { Page } from "./page.ts";
import {
  advanced,
  after,
  type Carried,
  carried,
  curvesAt,
  NOWHERE,
  type Pose,
  pose,
  sample,
} from "./playback.ts";
import * as questions from "./questions.ts";
import { type Changes, has, type State } from "./state.ts";

/** Milliseconds without a change until the whole clip is fetched. */
const IDLE = 140;

/** A body in space: its pose, its bones (J × 3, m), and the displacement by its laps. */
export interface Shown extends Pose {
  readonly offsets: Float32Array;
  readonly carried: Carried;
  /** Values of the card's curves. */
  readonly curves?: Float32Array | null;
}

/** Everything that a part of the page is given. */
export interface Session extends Page {
  readonly player: Player;
}

export class Player {
  readonly #page: Page;
  readonly #watchers = new Set<(shown: Shown) => void>();
  readonly #trusts = new Set<(trust: Trust) => void>();
  readonly #clips = new Set<(clip: Motion) => void>();
  readonly #pose: Pose;
  readonly #poses = new Latest<number>((turn) => this.#askPose(turn));
  readonly #whole = new Latest<number>((turn) => this.#askClip(turn));
  #offsets: Float32Array;
  #curves: Float32Array | null = null;
  #clip: Motion | null = null;
  #lap: Carried = NOWHERE;
  #carried: Carried = NOWHERE;
  /** Number of the newest question, and of the newest that is answered. */
  #turn = 0;
  #answered = 0;
  #request = new AbortController();
  #idle: ReturnType<typeof setTimeout> | undefined;
  trust: Trust | null = null;

  constructor(page: Page) {
    this.#page = page;
    this.#offsets = Float32Array.from(page.card.skeleton.offsets.flat());
    this.#pose = atRest(page.card);
    page.store.listen((state, changed) => this.#update(state, changed), page.signal);
    page.scene.add((seconds) => this.#step(seconds), page.signal);
    page.signal.addEventListener("abort", () => clearTimeout(this.#idle));
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

  /** Call now and with each new pose. */
  watch(watcher: (shown: Shown) => void): void {
    this.#watchers.add(watcher);
    watcher(this.shown);
  }

  /** Call with the trust of each answer. */
  onTrust(listener: (trust: Trust) => void): void {
    this.#trusts.add(listener);
    if (this.trust) listener(this.trust);
  }

  /** Call with each clip. */
  onClip(listener: (clip: Motion) => void): void {
    this.#clips.add(listener);
    if (this.#clip) listener(this.#clip);
  }

  /** Ask for a pose at once, and for the clip when nothing moves any more. */
  ask(): void {
    this.#next();
    this.#setClip(null);
    this.#poses.ask(this.#turn);
    this.#fetchClip(this.#answered ? IDLE : 0);
  }

  /** Number a question, and abort the clip that was asked for before. */
  #next(): void {
    this.#turn += 1;
    this.#request.abort();
  }

  /** The attribute on the stage tells tests that the clip has come. */
  #setClip(clip: Motion | null): void {
    this.#clip = clip;
    document.querySelector("#stage")!.toggleAttribute("data-clip", clip !== null);
  }

  #fetchClip(wait: number): void {
    clearTimeout(this.#idle);
    this.#idle = setTimeout(() => this.#whole.ask(this.#turn), wait);
  }

  #update(state: State, changed: Changes): void {
    if (has(changed, "controls", "performer", "labels", "level", "target")) this.ask();
    else if (has(changed, "loop", "root", ...questions.TAKE_AND_FEET)) {
      // The shown motion goes on until the other clip comes; another take goes on where it was.
      if (has(changed, "loop", "root")) this.#carried = NOWHERE;
      this.#next();
      this.#fetchClip(0);
    } else if (changed.has("time") && !state.playing) this.#show(state.time);
    if (has(changed, "playing", "view")) this.#page.scene.redraw();
  }

  async #askPose(turn: number): Promise<void> {
    const { card, service, signal, store } = this.#page;
    const { duration } = this;
    const time = Math.min(store.state.time, duration);
    const question = questions.pose(service, card, store.state, time, duration, signal);
    const answer = await this.#answer(question);
    if (!answer || turn < this.#answered) return;
    this.#pose.rotations.set(answer.rotations.subarray(0, this.#pose.rotations.length));
    this.#pose.root.set(answer.rootPosition.subarray(0, 3));
    this.#curves = answer.curves;
    this.#take(turn, answer);
    this.#announce();
  }

  async #askClip(turn: number): Promise<void> {
    const { card, service, signal, store } = this.#page;
    this.#request = new AbortController();
    const { loop, root } = store.state;
    const either = AbortSignal.any([signal, this.#request.signal]);
    const clip = await this.#answer(questions.clip(service, card, store.state, either));
    if (!clip || turn !== this.#turn) return;
    this.#setClip(clip);
    const travels = card.cyclic && loop && root === "travelling";
    this.#lap = travels ? carried(clip, card.skeleton.names.length) : NOWHERE;
    this.#take(turn, clip);
    this.#show(store.state.time);
    for (const listener of this.#clips) listener(clip);
  }

  /** Return the answer; null for a fault, which is shown, and when the page has gone on. */
  async #answer<Answer extends Poses>(request: Promise<Answer>): Promise<Answer | null> {
    const { card, notice, signal } = this.#page;
    try {
      const answer = await request;
      if (!signal.aborted) notice(null);
      // A model that replaces this one is opened anew, with its own controls and joints.
      return signal.aborted || answer.trust.model !== card.identity ? null : answer;
    } catch (fault) {
      if (!signal.aborted) notice(fault);
      return null;
    }
  }

  #take(turn: number, { boneOffsets, trust }: Poses): void {
    this.#answered = turn;
    this.#offsets = boneOffsets;
    this.trust = trust;
    const { store } = this.#page;
    const { inferred } = store.state;
    // Open controls follow without another request.
    const follow = trust.inferred?.map((name) => [name, trust.controls[name]!] as const) ?? [];
    if (follow.some(([name, value]) => inferred[name] !== value))
      store.set({ inferred: { ...inferred, ...Object.fromEntries(follow) } });
    for (const listener of this.#trusts) listener(trust);
    if (store.state.time > trust.duration) store.set({ time: trust.duration });
  }

  #step(seconds: number): boolean {
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
      this.#poses.ask(this.#turn);
      this.#fetchClip(IDLE);
      return;
    }
    sample(this.#pose, this.#clip, time);
    this.#curves = curvesAt(this.#clip, time);
    this.#announce();
  }

  #announce(): void {
    for (const watcher of this.#watchers) watcher(this.shown);
    this.#page.scene.redraw();
  }
}

/** The pose without turned joints, as high as the legs are long. */
function atRest({ skeleton }: ModelCard): Pose {
  const rest = pose(skeleton.names.length);
  for (let at = 0; at < rest.rotations.length; at += 4) rest.rotations[at] = 1;
  const heights: number[] = [];
  skeleton.parents.forEach((parent, joint) => {
    heights.push(parent < 0 ? 0 : heights[parent]! + skeleton.offsets[joint]![1]!);
  });
  rest.root[1] = -Math.min(...heights);
  return rest;
}
