/** What the parts of a performance share: its script, its answer, the chosen segment and the time. */

import { Latest } from "../latest.ts";
import type { Session } from "../session.ts";
import { faultsOf, type Performed, perform, plan, type Report, type Stage } from "./answers.ts";
import { Models } from "./models.ts";
import { compact, read, replaced, type Script, type Segment } from "./script.ts";
import type { Note } from "./timeline.ts";

/** script: it was changed. answer: a plan, a motion or a refusal came. */
export type Change = "script" | "answer" | "selected" | "time" | "shown";

type Listener = (change: Change) => void;

interface Asked {
  readonly text: string;
  /** Without poses, while something is dragged. */
  readonly quick: boolean;
}

export class Desk {
  readonly session: Session;
  readonly stage: Stage;
  readonly models: Models;
  readonly #listeners = new Set<Listener>();
  readonly #asking = new Latest<Asked>((asked) => this.#ask(asked));
  #script: Script | null = null;
  #selected = 0;
  #time = 0;
  #dragged = false;
  report: Report | null = null;
  performed: Performed | null = null;
  /** Of the newest answer: warnings, or faults where it was refused. */
  notes: readonly Note[] = [];
  refused = false;
  busy = false;
  /** Whether the camera goes along with the body. */
  follows = true;

  constructor(session: Session, stage: Stage) {
    this.session = session;
    this.stage = stage;
    this.models = new Models(session);
    const { signal, store } = session;
    const leave = store.listen((state, changed) => {
      if (changed.has("view")) this.#show();
      else if (changed.has("script") && this.shown) this.#read(state.script);
      // The service is back: everybody asks anew.
      else if (changed.has("controls")) this.ask();
    });
    signal.addEventListener("abort", leave);
  }

  /** Begins where the address is a performance's; call it when all parts listen. */
  begin(): void {
    if (this.shown) this.#show();
  }

  get shown(): boolean {
    return this.session.store.state.view === "performance";
  }

  get script(): Script | null {
    return this.#script;
  }

  get selected(): number {
    return this.#selected;
  }

  get segment(): Segment | undefined {
    return this.#script?.segments[this.#selected];
  }

  get time(): number {
    return this.#time;
  }

  get duration(): number {
    return this.report?.duration ?? 0;
  }

  listen(listener: Listener): void {
    this.#listeners.add(listener);
  }

  /** Another script, with that segment chosen. */
  edit(script: Script, selected = this.#selected): void {
    this.#selected = selected;
    this.session.store.set({ script: compact(script) });
  }

  change(segment: Segment, index = this.#selected): void {
    if (this.#script) this.edit(replaced(this.#script, index, segment));
  }

  select(index: number): void {
    if (index === this.#selected || !this.#script?.segments[index]) return;
    this.#selected = index;
    this.#tell("selected");
  }

  seek(time: number): void {
    this.#time = Math.min(this.duration, Math.max(0, time));
    this.#tell("time");
  }

  /** While something is dragged plans are enough, and the motion follows. */
  drag(dragged: boolean): void {
    this.#dragged = dragged;
    if (!dragged) this.ask();
  }

  ask(): void {
    if (!this.shown || !this.#script) return;
    this.#asking.ask({ text: this.session.store.state.script, quick: this.#dragged });
  }

  #show(): void {
    this.#tell("shown");
    if (!this.shown) return;
    this.#read(this.session.store.state.script);
  }

  async #first(): Promise<void> {
    const first = await this.models.first();
    if (first && this.shown && !this.#script) this.edit(first, 0);
  }

  #read(text: string): void {
    const found = read(text);
    if (typeof found === "string") {
      // An address without a script: as at the first visit.
      this.#script = null;
      void this.#first();
      return;
    }
    this.#script = found;
    this.#selected = Math.min(this.#selected, found.segments.length - 1);
    this.#tell("script");
    this.ask();
  }

  async #ask({ text, quick }: Asked): Promise<void> {
    const { notice, signal } = this.session;
    this.busy = true;
    this.#tell("answer");
    try {
      if (quick) this.report = await plan(this.stage, text, signal);
      else this.#take(await perform(this.stage, text, signal));
      if (signal.aborted) return;
      this.notes = this.report!.warnings.map(({ pointer, message }) => ({
        pointer,
        words: message,
        fault: false,
      }));
      this.refused = false;
      notice(null);
    } catch (fault) {
      if (signal.aborted) return;
      const found = faultsOf(fault);
      if (!found) return notice(fault);
      this.notes = found;
      this.refused = true;
    } finally {
      this.busy = false;
      if (!signal.aborted) this.#tell("answer");
    }
  }

  #take(found: Performed): void {
    this.performed = found;
    this.report = found.report;
    this.#time = Math.min(this.#time, found.report.duration);
  }

  #tell(change: Change): void {
    for (const listener of this.#listeners) listener(change);
  }
}
