/** Bodies on the stage: the motion that is shown, the nearest captured clip and other takes. */

import type { ModelCard, Motion } from "@posefield/client";

import { el } from "./dom.ts";
import { Figure } from "./figure.ts";
import { Latest } from "./latest.ts";
import { type Pose, pose, sample } from "./playback.ts";
import type { Session } from "./player.ts";
import { clip, otherTakes } from "./questions.ts";
import { type Changes, has, type State } from "./state.ts";
import * as theme from "./theme.ts";

/** Largest extent of a person's joints at rest, m. */
const PERSON = 1.5;
/** Milliseconds without a new answer until the nearest captured clip is asked for. */
const CALM = 160;
/** Number of other takes, and their opacity, which lets the body be seen. */
const [TAKES, PALE] = [5, 0.2];

export function mount(host: HTMLElement, session: Session): void {
  mountBody(session);
  host.append(new Ghost(session).label, new Fan(session).label);
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
  const scale = extent(card.skeleton) / PERSON;
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

/** Return the largest extent of the joints at rest, m. */
function extent({ parents, offsets }: ModelCard["skeleton"]): number {
  const points: number[][] = [];
  for (const [joint, parent] of parents.entries())
    points.push(offsets[joint]!.map((part, axis) => part + (points[parent]?.[axis] ?? 0)));
  const sizes = [0, 1, 2].map((axis) => {
    const values = points.map((point) => point[axis]!);
    return Math.max(...values) - Math.min(...values);
  });
  return Math.max(0.05, ...sizes);
}

/** A pale body, with its own clip. */
interface Companion {
  readonly figure: Figure;
  readonly pose: Pose;
  clip: Motion | null;
}

/** Pale bodies beside the motion, each at the same share of its own duration. */
abstract class Companions {
  abstract readonly label: HTMLElement;
  protected readonly session: Session;
  protected readonly latest = new Latest<null>(() => this.#fetch());
  protected companions: readonly Companion[] = [];
  readonly #toggle: "ghost" | "fan";
  readonly #count: number;
  readonly #opacity: number;

  constructor(session: Session, toggle: "ghost" | "fan", count: number, opacity: number) {
    this.session = session;
    this.#toggle = toggle;
    this.#count = count;
    this.#opacity = opacity;
    const { player, signal, store } = session;
    store.listen((_, changed) => this.update(changed), signal);
    player.watch(() => this.#move());
    theme.listen(() => {
      for (const { figure } of this.companions) figure.tint();
    }, signal);
    signal.addEventListener("abort", () => {
      for (const { figure } of this.companions) figure.dispose();
    });
  }

  /** Ask for the clips, where they have become others. */
  protected abstract fetch(): Promise<void>;
  /** Ask soon for the clips of what is shown now. */
  protected abstract refresh(): void;

  protected get wanted(): boolean {
    const { state } = this.session.store;
    return state[this.#toggle] && state.view === "one";
  }

  protected update(changed: Changes): void {
    if (has(changed, this.#toggle, "view", "body")) this.appear();
  }

  protected appear(): void {
    const { card, character, scene, store } = this.session;
    this.label.hidden = !this.wanted;
    if (this.wanted && !this.companions.length)
      this.companions = Array.from({ length: this.#count }, () => {
        const figure = new Figure(card, character, true, this.#opacity);
        scene.root.add(figure.group);
        return { figure, pose: pose(card.skeleton.names.length), clip: null };
      });
    for (const { figure } of this.companions) figure.wear(store.state.body);
    if (this.wanted) this.refresh();
    this.#move();
    scene.redraw();
  }

  async #fetch(): Promise<void> {
    const { notice, signal } = this.session;
    try {
      await this.fetch();
      if (!signal.aborted) this.#move();
    } catch (fault) {
      if (!signal.aborted) notice(fault);
    }
  }

  protected visible(): boolean {
    return this.wanted;
  }

  #move(): void {
    if (!this.companions.length) return;
    const { player, scene, store } = this.session;
    const { carried } = player.shown;
    for (const { clip, figure, pose } of this.companions) {
      figure.group.visible = clip !== null && this.visible();
      if (!clip || !figure.group.visible) continue;
      sample(pose, clip, (store.state.time / player.duration) * clip.trust.duration);
      figure.show({ ...pose, offsets: clip.boneOffsets, carried });
    }
    scene.redraw();
  }
}

/** The model's answer at the controls of the nearest captured clip. */
class Ghost extends Companions {
  readonly label = el("p", { class: "ghost", "data-ghost": "" });
  #timer: ReturnType<typeof setTimeout> | undefined;
  /** Source and settings of the clip that is shown. */
  #key = "";

  constructor(session: Session) {
    super(session, "ghost", 1, 0.32);
    session.player.onTrust(() => this.refresh());
    session.signal.addEventListener("abort", () => clearTimeout(this.#timer));
    this.appear();
  }

  protected override refresh(): void {
    if (!this.wanted) return;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.latest.ask(null), CALM);
  }

  protected override async fetch(): Promise<void> {
    const { card, service, signal, store } = this.session;
    const { controls, labels, performer, model } = store.state;
    const question = { controls, performer, labels, nearest: 1 };
    const [nearest] = (await service.client.why(model, question, signal)).nearest;
    if (!nearest || signal.aborted) return;
    this.label.textContent = `Ghost: the model at the controls of ${nearest.source}, the nearest captured clip (distance ${nearest.distance.toFixed(2)})`;
    const { level, loop, root, stands } = store.state;
    const key = `${nearest.source} ${level} ${root} ${loop} ${stands}`;
    if (key === this.#key) return;
    const state: State = {
      ...store.state,
      controls: nearest.controls,
      performer: nearest.performer,
      labels: nearest.labels ?? {},
      take: 0,
      detail: false,
      target: null,
    };
    this.companions[0]!.clip = await clip(service, card, state, signal);
    this.#key = key;
  }
}

/** Other takes of the same question. */
class Fan extends Companions {
  readonly label = el("p", { class: "ghost", "data-fan": "" });

  constructor(session: Session) {
    super(session, "fan", TAKES, PALE);
    session.player.onClip(() => this.appear());
    this.appear();
  }

  protected override refresh(): void {
    if (this.session.player.clip) this.latest.ask(null);
  }

  /** While controls are on the move, the clips of other takes are unknown. */
  protected override visible(): boolean {
    return this.wanted && this.session.player.clip !== null;
  }

  protected override async fetch(): Promise<void> {
    const { card, service, signal, store } = this.session;
    const { state } = store;
    const seeds = otherTakes(state.take, TAKES);
    const clips = await Promise.all(
      seeds.map((take) => clip(service, card, { ...state, take }, signal)),
    );
    if (signal.aborted) return;
    this.companions.forEach((companion, i) => {
      companion.clip = clips[i]!;
    });
    this.label.textContent = `Fan: takes ${seeds.join(", ")} of the same question, variety ${state.variety.toFixed(2)}`;
  }
}
