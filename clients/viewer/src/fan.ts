/** A few takes beside the motion that is shown: pale, each at the same share of its own duration. */

import type { Motion } from "@posefield/client";

import * as ask from "./ask.ts";
import { el } from "./dom.ts";
import { Figure } from "./figure.ts";
import { Latest } from "./latest.ts";
import { served } from "./page.ts";
import { type Pose, pose, sample } from "./playback.ts";
import type { Session } from "./session.ts";
import type { State } from "./state.ts";
import { otherTakes } from "./takes.ts";
import * as theme from "./theme.ts";

const COUNT = 5;
/** Opacity of each: together they leave the body to be seen. */
const PALE = 0.2;

export function mount(host: HTMLElement, session: Session): void {
  // Only a service has takes.
  if (served(session.source)) host.append(new Fan(session).label);
}

interface Member {
  readonly figure: Figure;
  readonly pose: Pose;
  clip: Motion | null;
}

class Fan {
  readonly label = el("p", { class: "ghost", "data-fan": "" });
  readonly #session: Session;
  readonly #ask = new Latest<null>(() => this.#find());
  /** Made when first wanted. */
  #members: readonly Member[] = [];

  constructor(session: Session) {
    const { player, signal, store } = session;
    this.#session = session;
    player.onClip(() => this.#appear());
    player.watch(() => this.#move());
    theme.listen(() => {
      for (const { figure } of this.#members) figure.tint();
    }, signal);
    const leave = store.listen((_, changed) => {
      if (["fan", "view", "body"].some((key) => changed.has(key as "fan"))) this.#appear();
    });
    signal.addEventListener("abort", () => {
      leave();
      for (const { figure } of this.#members) figure.dispose();
    });
    this.#appear();
  }

  get #wanted(): boolean {
    const { fan, view } = this.#session.store.state;
    return fan && view === "one";
  }

  #appear(): void {
    const { player, scene, store } = this.#session;
    this.label.hidden = !this.#wanted;
    if (this.#wanted && !this.#members.length) this.#make();
    for (const { figure } of this.#members) figure.wear(store.state.body);
    if (this.#wanted && player.clip) this.#ask.ask(null);
    this.#move();
    scene.redraw();
  }

  #make(): void {
    const { card, character, scene } = this.#session;
    this.#members = Array.from({ length: COUNT }, () => ({
      figure: new Figure(card, character, true, PALE),
      pose: pose(card.skeleton.names.length),
      clip: null,
    }));
    for (const { figure } of this.#members) scene.root.add(figure.group);
  }

  /** The clips of other takes of what is asked now. */
  async #find(): Promise<void> {
    const { card, notice, signal, source, store } = this.#session;
    const { state } = store;
    const seeds = otherTakes(state.take, COUNT);
    try {
      const clips = await Promise.all(
        seeds.map((take) => ask.clip(source, card, { ...state, take }, signal)),
      );
      if (signal.aborted) return;
      this.#members.forEach((member, i) => {
        member.clip = clips[i]!;
      });
      this.label.textContent = says(seeds, state);
      this.#move();
    } catch (fault) {
      if (!signal.aborted) notice(fault);
    }
  }

  /** While controls are on the move, nobody knows the clips of the other takes. */
  #move(): void {
    if (!this.#members.length) return;
    const { player, scene, store } = this.#session;
    const { carried } = player.shown;
    for (const { clip, figure, pose } of this.#members) {
      figure.group.visible = this.#wanted && clip !== null && player.clip !== null;
      if (!clip || !figure.group.visible) continue;
      sample(pose, clip, (store.state.time / player.duration) * clip.trust.duration);
      figure.show({ ...pose, offsets: clip.boneOffsets, carried });
    }
    scene.redraw();
  }
}

function says(seeds: readonly number[], { variety }: State): string {
  return `Fan: takes ${seeds.join(", ")} of the same question, variety ${variety.toFixed(2)}`;
}
