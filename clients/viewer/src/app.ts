/** The page as a whole: the shown model, its parts, and what happens when the service does not answer. */

import "./colours.css";
import "./style.css";
import { type ModelCard, type ModelSummary, Problem, Unexpected } from "@posefield/client";

import * as bodies from "./bodies.ts";
import { type Character, read } from "./character.ts";
import * as controls from "./controls.ts";
import * as crowd from "./crowd.ts";
import { KeyDialog, Notice, understood } from "./faults.ts";
import * as feet from "./feet.ts";
import * as files from "./files.ts";
import { type Address, address, follow, restored, written } from "./hash.ts";
import { Header, mountJumps, mountWelcome } from "./header.ts";
import * as levels from "./levels.ts";
import * as map from "./map.ts";
import * as panels from "./panels.ts";
import * as performance from "./performance/part.ts";
import { Player, type Session } from "./player.ts";
import { Scene } from "./scene.ts";
import { mismatch, Service, Watch } from "./service.ts";
import { type State, Store } from "./state.ts";
import * as target from "./target.ts";
import * as theme from "./theme.ts";
import * as transport from "./transport.ts";
import * as trust from "./trust.ts";

type Mount = (host: HTMLElement, session: Session) => void;

/** Parts in their order; each gets a section, named for styles and tests. */
const PARTS: Readonly<Record<"stage" | "side" | "transport", Readonly<Record<string, Mount>>>> = {
  stage: {
    options: panels.mountOptions,
    ghost: bodies.mount,
    levels: levels.mount,
    crowd: crowd.mount,
  },
  side: {
    jumps: mountJumps,
    welcome: mountWelcome,
    controls: controls.mount,
    takes: panels.mountTakes,
    trust: trust.mount,
    curves: panels.mountCurves,
    target: target.mount,
    map: map.mount,
    feet: feet.mount,
    files: files.mount,
    detail: panels.mountDetail,
  },
  transport: { time: transport.mount },
};

/** A model with its character. */
interface Model {
  readonly card: ModelCard;
  readonly character: Character;
}

interface Open extends Model {
  readonly model: string;
  readonly store: Store;
  readonly end: AbortController;
}

class App {
  readonly #service = new Service();
  readonly #notice = new Notice(at("#notice"));
  readonly #header = new Header(at("#bar"), (model) => this.#choose(model));
  readonly #key = new KeyDialog(document.body, (key) => {
    this.#service.use(key);
    void this.#reconnect();
  });
  readonly #watch = new Watch(
    () => this.#check(),
    () => this.#reconnect(),
  );
  #scene: Scene | null = null;
  #open: Open | null = null;
  /** Address that is not shown yet. */
  #wanted: Address | null = null;
  /** Number of the newest navigation, which overtakes earlier ones. */
  #turn = 0;

  start(): void {
    void this.#navigate(address(location.hash));
    void this.#compareVersions();
    addEventListener("popstate", () => void this.#restore(address(location.hash)));
    // The answers are on their way while the scene is built.
    try {
      this.#scene = new Scene(at("#stage"));
    } catch {
      this.#wanted = null;
      this.#turn += 1;
      this.#watch.end();
      this.#fault(NO_GRAPHICS);
    }
  }

  async #compareVersions(): Promise<void> {
    this.#notice.remark("version", await mismatch());
  }

  /** Open another model, as a step of the history. */
  #choose(model: string): void {
    history.pushState(null, "", `#${encodeURIComponent(model)}`);
    // A performance may use several models, and stays as it is.
    const script = this.#open?.store.state.script;
    void this.#navigate({ model, entries: script ? [["~script", script]] : [] });
  }

  /** Show the model of an address, or say why not. */
  async #navigate(wanted: Address): Promise<void> {
    const turn = ++this.#turn;
    this.#wanted = wanted;
    try {
      const [models, candidate] = await Promise.all([
        this.#service.client.models(),
        wanted.model ? this.#fetchIfThere(wanted.model) : null,
      ]);
      const there = candidate && isListed(models, wanted.model!) ? candidate : null;
      const name = there ? wanted.model! : models[0]?.name;
      if (!name) throw noModel(wanted.model);
      const model = there ?? (await this.#fetch(name));
      if (turn !== this.#turn) return;
      const missing =
        wanted.model && !there
          ? `${wanted.model} is not on this service (any more): showing ${name} instead.`
          : "";
      const entries = missing ? [] : wanted.entries;
      const { state, faults } = restored({ model: name, entries }, name, model.card);
      this.#show(name, model, new Store(calm(state, wanted)), models);
      this.#wanted = null;
      this.#notice.fault(null);
      this.#notice.remark("model", [missing, ...faults].filter(Boolean).join(" · ") || null);
    } catch (fault) {
      if (turn === this.#turn) this.#fault(fault);
    }
  }

  async #fetch(name: string): Promise<Model> {
    const [card, { content }] = await Promise.all([
      this.#service.client.card(name),
      this.#service.client.character(name),
    ]);
    return { card, character: read(content) };
  }

  /** Return null where there is no such model; throw other faults. */
  async #fetchIfThere(name: string): Promise<Model | null> {
    try {
      return await this.#fetch(name);
    } catch (fault) {
      const cause = fault instanceof Unexpected ? fault.cause : fault;
      // A name that no model can have is no path at all.
      const kinds = ["unknown-model", "no-such-path"];
      if (cause instanceof Problem && kinds.includes(cause.kind)) return null;
      throw fault;
    }
  }

  #show(name: string, model: Model, store: Store, models: readonly ModelSummary[]): void {
    const { card } = model;
    this.#open?.end.abort();
    if (this.#open?.model !== name) this.#scene!.frame();
    const end = new AbortController();
    const page = {
      store,
      service: this.#service,
      ...model,
      scene: this.#scene!,
      notice: (fault: unknown) => this.#fault(fault),
      signal: end.signal,
    };
    this.#open = { model: name, ...model, store, end };
    this.#header.list(models, name);
    this.#header.follow(store, end.signal);
    const player = new Player(page);
    player.ask();
    mountParts({ ...page, player });
    follow(store, card, end.signal);
    document.title = `${name} · posefield`;
  }

  /** Show the address after a step of the history, or one that was typed. */
  async #restore(wanted: Address): Promise<void> {
    const open = this.#open;
    if (!open || wanted.model !== open.model) return this.#navigate(wanted);
    this.#turn += 1;
    this.#wanted = null;
    this.#header.choose(open.model);
    const { state, faults } = restored(wanted, open.model, open.card);
    this.#notice.remark("model", faults.join(" · ") || null);
    const { controls } = open.store.state;
    const same = JSON.stringify(sorted(state.controls)) === JSON.stringify(sorted(controls));
    const playing = state.playing && !theme.still();
    open.store.set({ ...state, playing, ...(same ? { controls } : {}) });
  }

  /** Check that the shown model is still there, and the same. */
  async #check(): Promise<void> {
    if (this.#wanted) return this.#navigate(this.#wanted);
    const open = this.#open;
    if (!open) return;
    try {
      const models = await this.#service.client.models();
      if (open !== this.#open || this.#wanted) return;
      if (!isListed(models, open.model))
        return await this.#navigate({ model: open.model, entries: [] });
      this.#header.list(models, open.model);
      const listed = models.find(({ name }) => name === open.model);
      if (listed && listed.identity !== open.card.identity) await this.#replace(open, models);
    } catch (fault) {
      this.#fault(fault);
    }
  }

  /** Show the new version of a model, with the state as far as it fits. */
  async #replace(open: Open, models: readonly ModelSummary[]): Promise<void> {
    const { model: name, store } = open;
    const model = await this.#fetch(name);
    if (open !== this.#open || this.#wanted) return;
    const { state } = restored(address(written(store.state, open.card)), name, model.card);
    // A long script is not in the address.
    this.#show(name, model, new Store({ ...state, script: store.state.script }), models);
    this.#notice.remark("model", `${name} has been replaced on the service: this is the new one.`);
  }

  /** Ask anew for everything that is shown. */
  async #reconnect(): Promise<void> {
    void this.#compareVersions();
    const open = this.#open;
    await this.#check();
    // Every part asks anew when controls change.
    if (open && open === this.#open) open.store.set({ controls: { ...open.store.state.controls } });
  }

  #fault(fault: unknown): void {
    if (fault === null) {
      if (!this.#watch.down) this.#notice.fault(null);
      this.#watch.well();
      return;
    }
    const shown = understood(fault);
    if (!shown) return;
    const { remedy, text } = shown;
    this.#notice.fault(text, remedy === "key" ? this.#key.opener : null);
    if (remedy === "wait") this.#watch.failed();
    if (remedy === "key") this.#key.ask(text);
    if (remedy === "model") void this.#check();
  }
}

const NO_GRAPHICS =
  "This browser shows no 3-D graphics (WebGL 2), and this page shows nothing without. Turn on hardware acceleration in its settings, or open the page in another browser.";

function noModel(wanted: string | null): string {
  if (!wanted) return "This service has no models yet.";
  return `${wanted} is not on this service (any more), and there is no other model to show.`;
}

/** Tell whether the model is listed, by its name or by that of a version. */
function isListed(models: readonly ModelSummary[], model: string): boolean {
  return models.some(({ name, versions }) => name === model || versions.includes(model));
}

/** Pause for users who want no motion by itself, unless the address asks for it. */
function calm(state: State, { entries }: Address): State {
  const asked = entries.some(([key]) => key === "~playing");
  return theme.still() && !asked ? { ...state, playing: false } : state;
}

const sorted = (controls: State["controls"]) => Object.entries(controls).sort();

/** Mount all parts, until the session's signal. */
function mountParts(session: Session): void {
  for (const [area, parts] of Object.entries(PARTS)) {
    for (const [name, mount] of Object.entries(parts)) {
      const section = document.createElement("section");
      section.dataset["part"] = name;
      at(`#${area}`).append(section);
      session.signal.addEventListener("abort", () => section.remove());
      mount(section, session);
    }
  }
  performance.mount(session);
}

function at(selector: string): HTMLElement {
  return document.querySelector<HTMLElement>(selector)!;
}

theme.start();
new App().start();
