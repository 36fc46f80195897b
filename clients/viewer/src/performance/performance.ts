/** The performance that is edited: its script, the newest answer, and the time. */

import type { PerformanceMotion, PerformanceReport } from "@posefield/client";

import { Latest } from "../latest.ts";
import type { Session } from "../player.ts";
import { faultsOf, type Note, read } from "./script.ts";

/** script: it was changed. answer: an answer came or is asked for. */
export type Change = "script" | "answer" | "time" | "shown";

export class Performance {
  readonly session: Session;
  /** The newest motion; it stays while a script is refused. */
  motion: PerformanceMotion | null = null;
  /** Warnings of the newest answer, or faults of a script that was refused. */
  notes: readonly Note[] = [];
  refused = false;
  busy = false;
  time = 0;
  readonly #listeners = new Set<(change: Change) => void>();
  readonly #latest = new Latest<string>((script) => this.#fetch(script));

  constructor(session: Session) {
    this.session = session;
    session.store.listen((state, changed) => {
      if (changed.has("view")) this.#show();
      else if (changed.has("script") && this.shown) this.#read();
      // The page changes controls when the service is back.
      else if (changed.has("controls") && this.shown && state.script)
        this.#latest.ask(state.script);
    }, session.signal);
  }

  /** Show the performance of the address; call when all parts listen. */
  begin(): void {
    if (this.shown) this.#show();
  }

  get shown(): boolean {
    return this.session.store.state.view === "performance";
  }

  get report(): PerformanceReport | null {
    return this.motion?.trust ?? null;
  }

  get duration(): number {
    return this.report?.duration ?? 0;
  }

  listen(listener: (change: Change) => void): void {
    this.#listeners.add(listener);
  }

  seek(time: number): void {
    this.time = Math.min(this.duration, Math.max(0, time));
    this.#tell("time");
  }

  /** Show that time, and pause. */
  rest(time: number): void {
    this.session.store.set({ playing: false });
    this.seek(time);
  }

  #show(): void {
    this.#tell("shown");
    if (this.shown) this.#read();
  }

  #read(): void {
    const { card, store } = this.session;
    const { script } = store.state;
    if (typeof read(script) === "string") {
      const { model } = store.state;
      const walk = {
        ...{ kind: "walk", model, start: "standing", stop: "standing" },
        along: [
          [0, 2],
          [0, 5],
        ],
      };
      const walks = card.cyclic && card.root === "travelling";
      const segments = [walks ? walk : { kind: "act", model }];
      store.set({ script: JSON.stringify({ segments }) });
      return;
    }
    this.#tell("script");
    this.#latest.ask(script);
  }

  async #fetch(text: string): Promise<void> {
    const { notice, service, signal } = this.session;
    const script = read(text);
    if (typeof script === "string") return;
    this.busy = true;
    this.#tell("answer");
    try {
      const motion = await service.performances.performance(script, signal);
      if (signal.aborted) return;
      this.motion = motion;
      this.time = Math.min(this.time, motion.trust.duration);
      this.refused = false;
      this.notes = motion.trust.warnings.map(({ pointer, message }) => ({
        pointer,
        words: message,
        fault: false,
      }));
      notice(null);
    } catch (fault) {
      if (signal.aborted) return;
      const faults = faultsOf(fault);
      if (!faults) return notice(fault);
      this.notes = faults;
      this.refused = true;
    } finally {
      this.busy = false;
      if (!signal.aborted) this.#tell("answer");
    }
  }

  #tell(change: Change): void {
    for (const listener of this.#listeners) listener(change);
  }
}
