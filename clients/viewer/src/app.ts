/** The page as a whole: which model is shown, and what happens when the service does not answer. */

import { type ModelCard, type ModelSummary, Problem, Unexpected } from "@posefield/client";

import { type Character, read } from "./character.ts";
import { understood } from "./faults.ts";
import { type Address, address, restored } from "./hash.ts";
import { Header } from "./header.ts";
import { KeyDialog } from "./key.ts";
import { Notice } from "./notice.ts";
import { offline } from "./offline.ts";
import type { Source } from "./page.ts";
import * as parts from "./parts.ts";
import { Player } from "./player.ts";
import { Scene } from "./scene.ts";
import { mismatch, Service } from "./service.ts";
import { Store } from "./state.ts";
import * as sync from "./sync.ts";
import { still } from "./theme.ts";
import { Watch } from "./watch.ts";

/** A model as it is shown. */
interface Shape {
  readonly card: ModelCard;
  readonly character: Character;
}

interface Open extends Shape {
  readonly model: string;
  readonly store: Store;
  readonly end: AbortController;
}

export class App {
  readonly #service = new Service();
  #source: Source = this.#service;
  readonly #notice = new Notice(at("#notice"));
  readonly #header = new Header(at("#bar"), (model) => this.#choose(model));
  readonly #key = new KeyDialog(document.body, (key) => this.#unlock(key));
  readonly #watch = new Watch(
    () => this.#look(),
    () => this.#back(),
  );
  #scene: Scene | null = null;
  #open: Open | null = null;
  /** What is asked for and not shown yet. */
  #wanted: Address | null = null;
  #turn = 0;

  async start(): Promise<void> {
    try {
      // A copy without a service has its answers in itself.
      this.#source = (await offline()) ?? this.#service;
    } catch (fault) {
      this.#fault(`The answers in this page cannot be opened: ${fault}`);
      return;
    }
    void this.#go(address(location.hash));
    if (this.#source === this.#service) void this.#compare();
    addEventListener("popstate", () => void this.#restore(address(location.hash)));
    // What was asked for is on its way while this takes its time.
    try {
      this.#scene = new Scene(at("#stage"));
    } catch {
      this.#blind();
    }
  }

  /** Whether service and page speak the same contract. */
  async #compare(): Promise<void> {
    this.#notice.remark("version", await mismatch());
  }

  /** Without a stage there is nothing to show. */
  #blind(): void {
    this.#wanted = null;
    this.#turn += 1;
    this.#watch.end();
    this.#fault(
      "This browser shows no 3-D graphics (WebGL 2), and this page shows nothing without. Turn on hardware acceleration in its settings, or open the page in another browser.",
    );
  }

  /** A step that one may go back. */
  #choose(model: string): void {
    history.pushState(null, "", `#${encodeURIComponent(model)}`);
    // A performance is not of one model, and stays as it is.
    const script = this.#open?.store.state.script;
    void this.#go({ model, entries: script ? [["~script", script]] : [] });
  }

  /** Shows that model as the address says, or says why not. A later call overtakes this one. */
  async #go(wanted: Address): Promise<void> {
    const turn = ++this.#turn;
    this.#wanted = wanted;
    try {
      const [models, hoped] = await Promise.all([
        this.#source.models(),
        wanted.model ? this.#hoped(wanted.model) : null,
      ]);
      const found = hoped && listed(models, wanted.model!) ? hoped : null;
      const model = found ? wanted.model! : models[0]?.name;
      if (!model) throw none(wanted.model);
      const shape = found ?? (await this.#shape(model));
      if (turn !== this.#turn) return;
      const missing = wanted.model && !found ? gone(wanted.model, model) : "";
      const { state, faults } = restored(
        missing ? { model, entries: [] } : wanted,
        model,
        shape.card,
      );
      this.#show(model, shape, new Store(calm(state, wanted)), models);
      this.#wanted = null;
      this.#notice.fault(null);
      this.#notice.remark("model", [missing, ...faults].filter(Boolean).join(" · ") || null);
    } catch (fault) {
      if (turn === this.#turn) this.#fault(fault);
    }
  }

  /** null where there is no such model; other faults do not say that. */
  async #hoped(model: string): Promise<Shape | null> {
    try {
      return await this.#shape(model);
    } catch (fault) {
      if (lacks(fault)) return null;
      throw fault;
    }
  }

  async #shape(model: string): Promise<Shape> {
    const [card, { content }] = await Promise.all([
      this.#source.card(model),
      this.#source.character(model),
    ]);
    return { card, character: read(content) };
  }

  #show(model: string, shape: Shape, store: Store, models: readonly ModelSummary[]): void {
    const { card } = shape;
    this.#open?.end.abort();
    if (this.#open?.model !== model) this.#scene!.frame();
    const end = new AbortController();
    const page = {
      store,
      source: this.#source,
      ...shape,
      scene: this.#scene!,
      notice: (fault: unknown) => this.#fault(fault),
      signal: end.signal,
    };
    this.#open = { model, ...shape, store, end };
    this.#header.list(models, model);
    this.#header.follow(store, end.signal);
    const player = new Player(page);
    player.ask();
    parts.mount({ ...page, player });
    sync.follow(store, card, end.signal);
    document.title = `${model} · posefield`;
  }

  /** Back and forward, and addresses that somebody typed. */
  async #restore(wanted: Address): Promise<void> {
    const open = this.#open;
    if (!open || wanted.model !== open.model) return this.#go(wanted);
    // Whatever was on its way is not wanted any more.
    this.#turn += 1;
    this.#wanted = null;
    this.#header.choose(open.model);
    const { state, faults } = restored(wanted, open.model, open.card);
    this.#notice.remark("model", faults.join(" · ") || null);
    const { controls } = open.store.state;
    const same = Object.entries(state.controls).every(([name, value]) => controls[name] === value);
    const playing = state.playing && !still();
    open.store.set({ ...state, playing, ...(same ? { controls } : {}) });
  }

  /** Whether the model that is shown is still there, and the same. */
  async #look(): Promise<void> {
    if (this.#wanted) return this.#go(this.#wanted);
    const open = this.#open;
    if (!open) return;
    try {
      const models = await this.#source.models();
      if (open !== this.#open || this.#wanted) return;
      if (!listed(models, open.model)) return await this.#go({ model: open.model, entries: [] });
      const found = models.find(({ name }) => name === open.model);
      this.#header.list(models, open.model);
      if (found && found.identity !== open.card.identity) await this.#renew(open, models);
    } catch (fault) {
      this.#fault(fault);
    }
  }

  async #renew(open: Open, models: readonly ModelSummary[]): Promise<void> {
    const { model, store } = open;
    const shape = await this.#shape(model);
    const { card } = shape;
    if (open !== this.#open || this.#wanted) return;
    const known = new Set(card.controls.map(({ name }) => name));
    const entries = Object.entries(store.state.controls)
      .filter(([name]) => known.has(name))
      .map(([name, value]) => [name, String(value)] as const);
    const { state } = restored({ model, entries }, model, card);
    const { playing, body, fan, ghost, feet, loop, speed } = store.state;
    const { script, take, variety, view } = store.state;
    const kept = { playing, body, fan, ghost, feet, loop, speed, script, take, variety, view };
    this.#show(model, shape, new Store({ ...state, ...kept }), models);
    this.#notice.remark("model", `${model} has been replaced on the service: this is the new one.`);
  }

  /** The service answers again. */
  async #back(): Promise<void> {
    void this.#compare();
    const open = this.#open;
    await this.#look();
    // As if somebody had moved them: every part asks anew.
    if (open && open === this.#open) open.store.set({ controls: { ...open.store.state.controls } });
  }

  #unlock(key: string): void {
    this.#service.use(key);
    void this.#back();
  }

  #fault(fault: unknown): void {
    if (fault === null) {
      if (!this.#watch.down) this.#notice.fault(null);
      this.#watch.well();
      return;
    }
    const found = understood(fault);
    if (!found) return;
    this.#notice.fault(found.text, found.remedy === "key" ? this.#key.opener : null);
    if (found.remedy === "wait") this.#watch.failed();
    if (found.remedy === "key") this.#key.ask(found.text);
    if (found.remedy === "model") void this.#look();
  }
}

function gone(lost: string, shown: string): string {
  return `${lost} is not on this service (any more): showing ${shown} instead.`;
}

function none(lost: string | null): string {
  if (!lost) return "This service has no models yet.";
  return `${lost} is not on this service (any more), and there is no other model to show.`;
}

/** By its name, or by that of one of its versions. */
function listed(models: readonly ModelSummary[], model: string): boolean {
  return models.some(({ name, versions }) => name === model || versions.includes(model));
}

/** Whether the service says that it has no such model; a name that cannot be is no path at all. */
function lacks(fault: unknown): boolean {
  const said = fault instanceof Unexpected ? fault.cause : fault;
  return said instanceof Problem && ["unknown-model", "no-such-path"].includes(said.kind);
}

/** Nothing moves by itself for those who want it so, unless the address asks for it. */
function calm(state: ConstructorParameters<typeof Store>[0], { entries }: Address) {
  const asked = entries.some(([key]) => key === "~playing");
  return still() && !asked ? { ...state, playing: false } : state;
}

function at(selector: string): HTMLElement {
  return document.querySelector<HTMLElement>(selector)!;
}
