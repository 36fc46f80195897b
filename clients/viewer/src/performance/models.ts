/** The models of a service, and what a new segment of each is. */

import type { ModelCard } from "@posefield/client";

import type { Session } from "../session.ts";
import type { Act, Kind, Script, Segment } from "./script.ts";
import { plainName } from "./timeline.ts";

/** Cards that are asked for to tell walks from acts. */
const MOST = 64;

export class Models {
  readonly #session: Session;
  readonly #cards = new Map<string, ModelCard>();
  #coming: Promise<void> | null = null;

  constructor(session: Session) {
    this.#session = session;
    this.#cards.set(session.store.state.model, session.card);
  }

  /** Asks once for the cards of all models. */
  ready(): Promise<void> {
    this.#coming ??= this.#load();
    return this.#coming;
  }

  card(name: string): ModelCard | undefined {
    return this.#cards.get(name) ?? this.#cards.get(plainName(name));
  }

  /** Names of models that walk, or of those that act. */
  names(kind: Kind): readonly string[] {
    return [...this.#cards]
      .filter(([, card]) => walks(card) === (kind === "walk"))
      .map(([name]) => name);
  }

  /** A performance to begin with. */
  async first(): Promise<Script | null> {
    await this.ready();
    const own = plainName(this.#session.store.state.model);
    const name = this.#cards.has(own) ? own : [...this.#cards.keys()][0];
    if (!name) return null;
    if (!walks(this.card(name)!)) return { segments: [{ kind: "act", model: name }] };
    const along = [
      [0, 2],
      [1, 5],
    ] as const;
    return {
      segments: [{ kind: "walk", model: name, along, start: "standing", stop: "standing" }],
    };
  }

  /** A segment to be added after those; a string says why there is none. */
  async made(kind: Kind, script: Script): Promise<Segment | string> {
    if (kind === "hold") return { kind, seconds: 1 };
    await this.ready();
    const names = this.names(kind);
    const model = names.find((name) => this.#fits(name, script)) ?? names[0];
    if (!model)
      return `This service has no model ${kind === "walk" ? "that walks" : "for an act"}.`;
    if (kind === "walk") return { kind, model, seconds: 3 };
    return { kind, model } satisfies Act;
  }

  /** Whether a model has the joints of the others. */
  #fits(name: string, { segments }: Script): boolean {
    const joints = (model: string) => this.card(model)?.skeleton.parents.join();
    return segments.every((each) => {
      const other = each.kind === "hold" ? undefined : joints(each.model);
      return other === undefined || other === joints(name);
    });
  }

  async #load(): Promise<void> {
    const { notice, signal, source } = this.#session;
    try {
      const listed = (await source.models(signal)).slice(0, MOST);
      const cards = await Promise.all(listed.map(({ name }) => source.card(name, signal)));
      this.#cards.clear();
      listed.forEach(({ name }, i) => {
        this.#cards.set(name, cards[i]!);
      });
    } catch (fault) {
      this.#coming = null;
      if (!signal.aborted) notice(fault);
    }
  }
}

function walks({ cyclic, root }: ModelCard): boolean {
  return cyclic && root === "travelling";
}
