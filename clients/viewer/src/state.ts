/** What the page shows, in one place; the address bar's hash holds it, so that it can be sent on. */

export type View = "one" | "levels" | "crowd" | "performance";

export interface State {
  readonly model: string;
  /** A number for each control, in its unit. */
  readonly controls: Readonly<Record<string, number>>;
  readonly performer: string | null;
  /** A name for each label set besides performers; those that are not named are left open. */
  readonly labels: Readonly<Record<string, string>>;
  readonly level: number;
  /** Seconds from the start of the clip. */
  readonly time: number;
  readonly playing: boolean;
  /** Times as fast as it was moved. */
  readonly speed: number;
  readonly loop: boolean;
  readonly root: "travelling" | "in_place";
  readonly body: "stick" | "mannequin";
  readonly ghost: boolean;
  /** Takes beside the motion that is shown. */
  readonly fan: boolean;
  /** Contacts and skate. */
  readonly feet: boolean;
  /** Whether the feet of clips are made to stand; else they are as predicted. */
  readonly stands: boolean;
  /** Height of the floor on which feet stand, m. */
  readonly floor: number;
  /** Seed of another take; 0 is the prediction. */
  readonly take: number;
  /** Size of a take's deviations, from 0 to 1. */
  readonly variety: number;
  /** Details that no control predicts, sampled by the seed. */
  readonly detail: boolean;
  /** Where the event's joint shall be, m; null while no target is wanted. */
  readonly target: readonly [number, number, number] | null;
  readonly view: View;
  /** The two controls of the map. */
  readonly across: string;
  readonly along: string;
  /** Characters of the crowd, and the pixels that their errors may cover. */
  readonly crowd: number;
  /** Whether the crowd's motions are takes, so that hardly any two are alike. */
  readonly varied: boolean;
  readonly pixels: number;
  /** Of the performance, as JSON; empty until one is begun. */
  readonly script: string;
}

export type Listener = (state: State, changed: ReadonlySet<keyof State>) => void;

/** The state and who wants to know of its changes. */
export class Store {
  #state: State;
  readonly #listeners = new Set<Listener>();

  constructor(state: State) {
    this.#state = state;
  }

  get state(): State {
    return this.#state;
  }

  /** Takes what differs, and tells everybody once. */
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

  /** Returns how to stop being told. */
  listen(listener: Listener): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }
}
