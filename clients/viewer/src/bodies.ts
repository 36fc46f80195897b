/** Bodies on the stage: the motion that is shown, the nearest captured clip and other takes. */

import type { Motion } from "@posefield/client";

import { ladder } from "./detail.ts";
import { el } from "./dom.ts";
import { Figure } from "./figure.ts";
import { Latest } from "./latest.ts";
import { type Pose, pose, sample } from "./playback.ts";
import type { Session } from "./player.ts";
import { clip, otherTakes } from "./questions.ts";
import { has, type State } from "./state.ts";
import * as theme from "./theme.ts";

/** Radius about the root of a person's joints at rest, m. */
const PERSON = 0.9;
/** Number of other takes, and their opacity, which lets the body be seen. */
const [TAKES, PALE] = [5, 0.2];

export function mount(host: HTMLElement, session: Session): void {
  mountBody(session);
  host.append(ghost(session), fan(session));
}

function mountBody({ card, character, player, scene, signal, store }: Session): void {
  const figure = new Figure(card, character, false);
  scene.root.add(figure.group);
  store.listen((_, changed) => {
    if (has(changed, "body", "view")) dress();
  }, signal);
  const dress = () => {
    figure.wear(store.state.body);
    figure.group.visible = store.state.view === "one";
    scene.redraw();
  };
  dress();
  const scale = ladder(card).radius / PERSON;
  let unusual = scale < 0.5 || scale > 1.5;
  player.watch((shown) => {
    figure.show(shown);
    figure.group.updateMatrixWorld();
    const root = figure.group.position.clone().fromArray(shown.root);
    const { x, y, z } = figure.group.localToWorld(root);
    // Before the first answer the body is at rest, wherever that is.
    if (unusual && player.trust) {
      scene.frame(scale, y);
      unusual = false;
    }
    if (figure.group.visible) scene.follow(x, z);
  });
  theme.listen(() => figure.tint(), signal);
  signal.addEventListener("abort", () => figure.dispose());
}

/** A pale body, with its own clip. */
interface Companion {
  readonly figure: Figure;
  readonly pose: Pose;
  clip: Motion | null;
}

/** Pale bodies beside the motion, each at the same share of its own duration. */
class Companions {
  readonly label: HTMLElement;
  readonly #session: Session;
  readonly #toggle: "ghost" | "fan";
  readonly #fetch: () => Promise<readonly Motion[] | null>;
  readonly #latest = new Latest<null>(() => this.#refresh());
  readonly #make: () => readonly Companion[];
  #companions: readonly Companion[] = [];

  /** fetch: returns the clips, or null where they are those that are shown. */
  constructor(
    session: Session,
    toggle: "ghost" | "fan",
    [count, opacity]: readonly [number, number],
    fetch: (label: HTMLElement) => Promise<readonly Motion[] | null>,
  ) {
    const { card, character, player, scene, signal, store } = session;
    this.#session = session;
    this.#toggle = toggle;
    this.label = el("p", { class: "ghost", [`data-${toggle}`]: "" });
    this.#fetch = () => fetch(this.label);
    this.#make = () =>
      Array.from({ length: count }, () => {
        const figure = new Figure(card, character, true, opacity);
        scene.root.add(figure.group);
        return { figure, pose: pose(card.skeleton.names.length), clip: null };
      });
    store.listen((_, changed) => {
      if (has(changed, toggle, "view", "body")) this.appear();
    }, signal);
    player.watch(() => this.#move());
    theme.listen(() => {
      for (const { figure } of this.#companions) figure.tint();
    }, signal);
    signal.addEventListener("abort", () => {
      for (const { figure } of this.#companions) figure.dispose();
    });
    this.appear();
  }

  get #wanted(): boolean {
    const { state } = this.#session.store;
    return state[this.#toggle] && state.view === "one";
  }

  /** Show or hide the bodies, and ask for their clips. */
  appear(): void {
    this.label.hidden = !this.#wanted;
    if (this.#wanted && !this.#companions.length) this.#companions = this.#make();
    for (const { figure } of this.#companions) figure.wear(this.#session.store.state.body);
    if (this.#wanted && this.#session.player.clip) this.#latest.ask(null);
    this.#move();
  }

  async #refresh(): Promise<void> {
    const { notice, signal } = this.#session;
    try {
      const clips = await this.#fetch();
      if (signal.aborted || !clips) return;
      this.#companions.forEach((companion, i) => {
        companion.clip = clips[i]!;
      });
      this.#move();
    } catch (fault) {
      if (!signal.aborted) notice(fault);
    }
  }

  /** Pose the bodies; while controls are on the move, their clips are not known. */
  #move(): void {
    if (!this.#companions.length) return;
    const { player, scene, store } = this.#session;
    const { carried } = player.shown;
    for (const { clip, figure, pose } of this.#companions) {
      figure.group.visible = clip !== null && this.#wanted && player.clip !== null;
      if (!clip || !figure.group.visible) continue;
      sample(pose, clip, (store.state.time / player.duration) * clip.trust.duration);
      figure.show({ ...pose, offsets: clip.boneOffsets, carried });
    }
    scene.redraw();
  }
}

/** The model's answer at the controls of the nearest captured clip. */
function ghost(session: Session): HTMLElement {
  const { card, player, service, signal, store } = session;
  /** Source and settings of the clip that is shown. */
  let shown = "";
  const companions = new Companions(session, "ghost", [1, 0.32], async (label) => {
    const { controls, labels, performer, model } = store.state;
    const question = { controls, performer, labels, nearest: 1 };
    const reasons = await service.client.why(model, question, signal);
    const [nearest] = reasons.nearest;
    if (!nearest || reasons.model !== card.identity || signal.aborted) return null;
    const text = `Ghost: the model at the controls of ${nearest.source}, the nearest captured clip (distance ${nearest.distance.toFixed(2)})`;
    const { level, loop, root, stands } = store.state;
    const key = `${nearest.source} ${level} ${root} ${loop} ${stands}`;
    if (key === shown) {
      label.textContent = text;
      return null;
    }
    const state: State = {
      ...store.state,
      controls: nearest.controls,
      performer: nearest.performer,
      labels: nearest.labels ?? {},
      ...{ take: 0, detail: false, target: null },
    };
    const motion = await clip(service, card, state, signal);
    label.textContent = text;
    shown = key;
    return [motion];
  });
  player.onClip(() => companions.appear());
  return companions.label;
}

/** Other takes of the same question. */
function fan(session: Session): HTMLElement {
  const { card, player, service, signal, store } = session;
  const companions = new Companions(session, "fan", [TAKES, PALE], async (label) => {
    const { state } = store;
    const seeds = otherTakes(state.take, TAKES);
    const clips = await Promise.all(
      seeds.map((take) => clip(service, card, { ...state, take }, signal)),
    );
    label.textContent = `Fan: takes ${seeds.join(", ")} of the same question, variety ${state.variety.toFixed(2)}`;
    return clips;
  });
  player.onClip(() => companions.appear());
  return companions.label;
}
