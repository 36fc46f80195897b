/** State of the page in one place; the address bar's hash holds it, so that it can be sent on. */

export type View = "one" | "levels" | "crowd" | "performance";

export interface State {
  readonly model: string;
  /** Values of the controls that were set; the service infers the others. */
  readonly controls: Readonly<Record<string, number>>;
  /** A value for each control, as last inferred; before that its default. */
  readonly inferred: Readonly<Record<string, number>>;
  readonly performer: string | null;
  /** A name for each label set besides performers; sets without a name are left open. */
  readonly labels: Readonly<Record<string, string>>;
  readonly level: number;
  /** Seconds from the start of the clip. */
  readonly time: number;
  readonly playing: boolean;
  /** Factor of the playback speed. */
  readonly speed: number;
  readonly loop: boolean;
  readonly root: "travelling" | "in_place";
  readonly body: "stick" | "mannequin";
  readonly ghost: boolean;
  /** Show other takes beside the motion. */
  readonly fan: boolean;
  /** Show contacts and skate. */
  readonly feet: boolean;
  /** Ask for feet that stand; else they are as predicted. */
  readonly stands: boolean;
  /** Height of the floor on which feet stand, m. */
  readonly floor: number;
  /** Seed of another take; 0 is the prediction. */
  readonly take: number;
  /** Size of a take's deviations, from 0 to 1. */
  readonly variety: number;
  /** Sample the details that no control predicts. */
  readonly detail: boolean;
  /** Target of the event's joint, m. */
  readonly target: readonly [number, number, number] | null;
  readonly view: View;
  /** The two controls of the map. */
  readonly across: string;
  readonly along: string;
  /** Characters of the crowd, and the pixels that their errors may cover. */
  readonly crowd: number;
  readonly pixels: number;
  /** Give the crowd many takes as motions. */
  readonly varied: boolean;
  /** Script of the performance, as JSON; empty until one is begun. */
  readonly script: string;
}

/** Return a value for each control: that which was set, else the inferred one. */
export function valuesOf({ controls, inferred }: Pick<State, "controls" | "inferred">) {
  return { ...inferred, ...controls };
}

export type Changes = ReadonlySet<keyof State>;
export type Listener = (state: State, changed: Changes) => void;

/** Tell whether one of these parts has changed. */
export function has(changed: Changes, ...keys: readonly (keyof State)[]): boolean {
  return keys.some((key) => changed.has(key));
}

export class Store {
  #state: State;
  readonly #listeners = new Set<Listener>();

  constructor(state: State) {
    this.#state = state;
  }

  get state(): State {
    return this.#state;
  }

  /** Take over the values that differ, and call each listener once. */
  set(part: Partial<State>): void {
    const before = this.#state;
    const entries = Object.entries(part) as [keyof State, State[keyof State]][];
    const changed = new Set(
      entries.filter(([key, value]) => before[key] !== value).map(([key]) => key),
    );
    if (!changed.size) return;
    this.#state = { ...before, ...part };
    for (const listener of this.#listeners) listener(this.#state, changed);
  }

  /** Call the listener after each change, until the signal. */
  listen(listener: Listener, signal: AbortSignal): void {
    this.#listeners.add(listener);
    signal.addEventListener("abort", () => this.#listeners.delete(listener));
  }

  /** Call now, and after each change. */
  follow(show: (state: State) => void, signal: AbortSignal): void {
    show(this.#state);
    this.listen(show, signal);
  }
}
