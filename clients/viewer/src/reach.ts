/** Controls that bring the event's joint to a point, asked for step by step. */

import type { CrowdPoses, Motion } from "@posefield/client";

import { pose, sample } from "./playback.ts";
import type { CardEvent, Session } from "./session.ts";
import { place, placed } from "./skeleton.ts";
import { Descent, type Places, type Point } from "./solve.ts";

/** Steps at most, and what is near enough, m. */
const STEPS = 12;
const NEAR = 0.001;
/** Later than this share of a clip, how long each clip is has to be asked first. */
const LATE = 0.85;
/** So much before its end is a clip's end, whatever was rounded. */
const END = 0.9999;

export class Reach {
  readonly #session: Session;
  readonly #event: CardEvent;
  /** Names of the controls that may be moved: those sampled at a few values are held. */
  readonly #free: readonly string[];
  /** Whether it is this that changes the controls now. */
  taking = false;
  #start: readonly number[] = [];
  /** Of each setting that was asked about last, s. */
  #durations: readonly number[] = [];

  constructor(session: Session, event: CardEvent) {
    this.#session = session;
    this.#event = event;
    this.#free = session.card.controls
      .filter((each) => !each.values.length)
      .map((each) => each.name);
  }

  /** From here on the controls leave where they are now only as far as they must. */
  begin(): void {
    const { player, store } = this.#session;
    this.#start = this.#within();
    this.#durations = [];
    store.set({ playing: false, time: this.#event.share * player.duration });
  }

  /** The miss (m) at each step, while it is wanted; the controls follow. */
  async *towards(point: Point, wanted: () => boolean): AsyncGenerator<number> {
    const { card, player } = this.#session;
    const free = this.#free.map((name) => card.controls.find((each) => each.name === name)!);
    let values = this.#within();
    const places: Places = (settings) => this.#places(settings);
    const descent = new Descent(places, free, values, this.#start, point);
    for (let left = STEPS; left > 0 && wanted(); left--) {
      const found = await descent.step();
      if (!wanted()) return;
      if (found.values !== values) this.#take(found.values, player.duration);
      values = found.values;
      yield found.miss;
      if (found.miss < NEAR) return;
    }
  }

  /** Where the joint is at its moment in a clip, m. */
  reached(clip: Motion): Point {
    const { parents } = this.#session.card.skeleton;
    const now = pose(parents.length);
    sample(now, clip, this.#event.share * clip.trust.duration);
    return this.#placed(clip.boneOffsets, now.rotations, now.root);
  }

  #take(values: readonly number[], duration: number): void {
    const { store } = this.#session;
    const moved = Object.fromEntries(this.#free.map((name, i) => [name, rounded(values[i]!)]));
    this.taking = true;
    store.set({
      controls: { ...store.state.controls, ...moved },
      time: this.#event.share * (this.#durations[0] ?? duration),
    });
    this.taking = false;
  }

  /** The free controls' present values, brought within what was sampled. */
  #within(): readonly number[] {
    const { card, store } = this.#session;
    return this.#free.map((name) => {
      const { minimum, maximum } = card.controls.find((each) => each.name === name)!;
      return Math.min(maximum, Math.max(minimum, store.state.controls[name]!));
    });
  }

  /** A crowd of as many as there are settings, all at the moment of the event. */
  async #places(settings: readonly (readonly number[])[]): Promise<readonly Point[]> {
    const { card, player, signal, source, store } = this.#session;
    const { controls, labels, level, model, performer } = store.state;
    const columns = Object.fromEntries(
      card.controls.map(({ name }) => {
        const free = this.#free.indexOf(name);
        return [name, settings.map((row) => (free < 0 ? controls[name]! : row[free]!))];
      }),
    );
    const who = { labels, level, performer };
    const ask = (time: readonly number[]) =>
      source.crowd(model, { controls: columns, time: [...time], ...who }, signal);
    const share = Math.min(END, this.#event.share);
    if (share > LATE) this.#durations = [...(await ask(settings.map(() => 0))).duration];
    const crowd = await ask(
      settings.map((_, i) => share * (this.#durations[i] ?? player.duration)),
    );
    this.#durations = [...crowd.duration];
    return settings.map((_, i) => this.#of(crowd, i));
  }

  #of(crowd: CrowdPoses, i: number): Point {
    const joints = crowd.names.length;
    return this.#placed(
      crowd.boneOffsets.subarray(3 * joints * i, 3 * joints * (i + 1)),
      crowd.rotations.subarray(4 * joints * i, 4 * joints * (i + 1)),
      crowd.rootPosition.subarray(3 * i, 3 * i + 3),
    );
  }

  #placed(offsets: Float32Array, rotations: Float32Array, root: Float32Array): Point {
    const { parents } = this.#session.card.skeleton;
    const { positions } = place(placed(parents.length), parents, offsets, rotations, root, 0);
    const at = 3 * this.#event.joint;
    return [positions[at]!, positions[at + 1]!, positions[at + 2]!];
  }
}

function rounded(value: number): number {
  return Number(value.toPrecision(6));
}
