/** The nearest captured clip, as the model answers at its controls: pale, beside the body itself. */

import type { Motion, Reasons } from "@posefield/client";

import * as ask from "./ask.ts";
import { el } from "./dom.ts";
import { Figure } from "./figure.ts";
import { Latest } from "./latest.ts";
import { served } from "./page.ts";
import { NOWHERE, type Pose, pose, sample } from "./playback.ts";
import type { Session } from "./session.ts";
import * as theme from "./theme.ts";

const CALM = 160;

type Captured = Reasons["nearest"][number];

export function mount(host: HTMLElement, session: Session): void {
  const ghost = new Ghost(session);
  host.append(ghost.label);
}

class Ghost {
  readonly label = el("p", { class: "ghost", "data-ghost": "" });
  readonly #session: Session;
  readonly #figure: Figure;
  readonly #pose: Pose;
  readonly #ask = new Latest<null>(() => this.#find());
  #clip: Motion | null = null;
  #of = "";
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(session: Session) {
    const { card, character, player, scene, signal, store } = session;
    this.#session = session;
    this.#figure = new Figure(card, character, true);
    this.#pose = pose(card.skeleton.names.length);
    scene.root.add(this.#figure.group);
    theme.listen(() => this.#figure.tint(), signal);
    player.watch(() => this.#move());
    player.onTrust(() => this.#soon());
    const leave = store.listen((_, changed) => {
      if (["ghost", "view", "body"].some((key) => changed.has(key as "ghost"))) this.#appear();
      if (["root", "loop", "stands"].some((key) => changed.has(key as "root"))) this.#of = "";
    });
    signal.addEventListener("abort", () => {
      clearTimeout(this.#timer);
      leave();
      this.#figure.dispose();
    });
    this.#appear();
  }

  get #wanted(): boolean {
    const { source, store } = this.#session;
    // Only a service says which example is the nearest.
    return store.state.ghost && store.state.view === "one" && served(source);
  }

  #appear(): void {
    this.#figure.wear(this.#session.store.state.body);
    this.#figure.group.visible = this.#wanted && this.#clip !== null;
    this.label.hidden = !this.#wanted;
    if (this.#wanted) this.#soon();
    this.#session.scene.redraw();
  }

  #soon(): void {
    if (!this.#wanted) return;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#ask.ask(null), CALM);
  }

  /** The clip of the nearest example, where that has become another. */
  async #find(): Promise<void> {
    const { card, notice, signal, source, store } = this.#session;
    const { controls, labels, performer, model } = store.state;
    try {
      const { nearest } = await source.why(
        model,
        { controls, performer, labels, nearest: 1 },
        signal,
      );
      const [first] = nearest;
      if (!first || signal.aborted) return;
      this.label.textContent = says(first);
      const { level, loop, root, stands } = store.state;
      const of = `${first.source} ${level} ${root} ${loop} ${stands}`;
      if (of === this.#of) return;
      const own = { performer: first.performer, labels: first.labels ?? {} };
      const predicted = { ...own, take: 0, detail: false };
      const there = { ...store.state, controls: first.controls, ...predicted };
      this.#clip = await ask.clip(source, card, there, signal);
      this.#of = of;
      this.#figure.group.visible = this.#wanted;
      this.#move();
    } catch (fault) {
      if (!signal.aborted) notice(fault);
    }
  }

  /** At the same share of its own duration. */
  #move(): void {
    if (!this.#clip || !this.#wanted) return;
    const { player, scene, store } = this.#session;
    const { duration } = this.#clip.trust;
    sample(this.#pose, this.#clip, (store.state.time / player.duration) * duration);
    this.#figure.show({ ...this.#pose, offsets: this.#clip.boneOffsets, carried: this.#place() });
    scene.redraw();
  }

  /** Where the body's own laps began. */
  #place() {
    return this.#session.player.shown.carried ?? NOWHERE;
  }
}

function says({ distance, source }: Captured): string {
  return `Ghost: the model at the controls of ${source}, the nearest captured clip (distance ${distance.toFixed(2)})`;
}
