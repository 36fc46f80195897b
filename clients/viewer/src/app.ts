/** The page as a whole: which model is shown, and what happens when the service does not answer. */

import type { ModelCard, ModelSummary } from "@posefield/client";

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

interface Open {
  readonly model: string;
  readonly card: ModelCard;
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
  #turn = 0;

  async start(): Promise<void> {
    try {
      // A copy without a service has its answers in itself.
      this.#source = (await offline()) ?? this.#service;
    } catch (fault) {
      this.#fault(`The model of this page cannot be opened: ${fault}`);
      return;
    }
    void this.#go(address(location.hash));
    if (this.#source === this.#service) {
      void mismatch().then((words) => words && this.#notice.remark(words));
    }
    addEventListener("popstate", () => void this.#restore(address(location.hash)));
    // What was asked for is on its way while this takes its time.
    this.#scene = new Scene(at("#stage"));
  }

  /** A step that one may go back. */
  #choose(model: string): void {
    history.pushState(null, "", `#${encodeURIComponent(model)}`);
    void this.#go({ model, entries: [] });
  }

  /** Shows that model as the address says, or says why not. A later call overtakes this one. */
  async #go(wanted: Address): Promise<void> {
    const turn = ++this.#turn;
    try {
      const [models, hoped] = await Promise.all([
        this.#source.models(),
        wanted.model ? this.#source.card(wanted.model).catch(() => null) : null,
      ]);
      const model = hoped ? wanted.model! : models[0]?.name;
      if (!model) throw "This service has no models yet.";
      const card = hoped ?? (await this.#source.card(model));
      if (turn !== this.#turn) return;
      const missing = wanted.model && !hoped ? gone(wanted.model, model) : "";
      const { state, faults } = restored(missing ? { model, entries: [] } : wanted, model, card);
      this.#show(model, card, new Store(calm(state, wanted)), models);
      this.#notice.fault(null);
      const remarks = [missing, ...faults].filter(Boolean);
      if (remarks.length) this.#notice.remark(remarks.join(" · "));
    } catch (fault) {
      this.#fault(fault);
    }
  }

  #show(model: string, card: ModelCard, store: Store, models: readonly ModelSummary[]): void {
    this.#open?.end.abort();
    if (this.#open?.model !== model) this.#scene!.frame();
    const end = new AbortController();
    const page = {
      store,
      source: this.#source,
      card,
      scene: this.#scene!,
      notice: (fault: unknown) => this.#fault(fault),
      signal: end.signal,
    };
    this.#open = { model, card, store, end };
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
    const { state, faults } = restored(wanted, open.model, open.card);
    this.#notice.remark(faults.join(" · ") || null);
    const { controls } = open.store.state;
    const same = Object.entries(state.controls).every(([name, value]) => controls[name] === value);
    const playing = state.playing && !still();
    open.store.set({ ...state, playing, ...(same ? { controls } : {}) });
  }

  /** Whether the model that is shown is still there, and the same. */
  async #look(): Promise<void> {
    const open = this.#open;
    if (!open) return this.#go(address(location.hash));
    try {
      const models = await this.#source.models();
      if (open !== this.#open) return;
      const found = models.find(({ name }) => name === open.model);
      if (!found && !open.model.includes("@")) return await this.#fallBack(open.model, models);
      this.#header.list(models, open.model);
      if (found && found.identity !== open.card.identity) await this.#renew(open, models);
    } catch (fault) {
      this.#fault(fault);
    }
  }

  async #renew({ model, store }: Open, models: readonly ModelSummary[]): Promise<void> {
    const card = await this.#source.card(model);
    const known = new Set(card.controls.map(({ name }) => name));
    const entries = Object.entries(store.state.controls)
      .filter(([name]) => known.has(name))
      .map(([name, value]) => [name, String(value)] as const);
    const { state } = restored({ model, entries }, model, card);
    const { playing, body, ghost, feet, loop, speed, view } = store.state;
    const kept = { playing, body, ghost, feet, loop, speed, view };
    this.#show(model, card, new Store({ ...state, ...kept }), models);
    this.#notice.remark(`${model} has been replaced on the service: this is the new one.`);
  }

  async #fallBack(lost: string, models: readonly ModelSummary[]): Promise<void> {
    const other = models.find(({ name }) => name !== lost);
    if (!other) throw `${lost} is gone from the service, and there is no other model to show.`;
    await this.#go({ model: other.name, entries: [] });
    this.#notice.remark(gone(lost, other.name));
  }

  /** The service answers again. */
  async #back(): Promise<void> {
    void mismatch().then((words) => words && this.#notice.remark(words));
    const open = this.#open;
    if (!open) return this.#go(address(location.hash));
    await this.#look();
    // As if somebody had moved them: every part asks anew.
    if (open === this.#open) open.store.set({ controls: { ...open.store.state.controls } });
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
    this.#notice.fault(found.text);
    if (found.remedy === "wait") this.#watch.failed();
    if (found.remedy === "key") this.#key.ask(found.text);
    if (found.remedy === "model") void this.#look();
  }
}

function gone(lost: string, shown: string): string {
  return `${lost} is not on this service (any more): showing ${shown} instead.`;
}

/** Nothing moves by itself for those who want it so, unless the address asks for it. */
function calm(state: ConstructorParameters<typeof Store>[0], { entries }: Address) {
  const asked = entries.some(([key]) => key === "~playing");
  return still() && !asked ? { ...state, playing: false } : state;
}

function at(selector: string): HTMLElement {
  return document.querySelector<HTMLElement>(selector)!;
}
