/** The body of a performance on the stage: it plays, and the camera follows it. */

import * as character from "../character.ts";
import { Figure } from "../figure.ts";
import { advanced, NOWHERE, type Pose, pose, sample, step } from "../playback.ts";
import * as theme from "../theme.ts";
import { onKeys } from "../transport.ts";
import type { Performance } from "./performance.ts";

export function mount(performance: Performance): void {
  const stage = new Stage(performance);
  const { scene, signal, store } = performance.session;
  scene.add((seconds) => stage.step(seconds), signal);
  performance.listen((change) => {
    if (change === "answer") void stage.update();
    if (change === "time" || change === "shown") stage.draw();
  });
  theme.listen(() => stage.figure?.tint(), signal);
  signal.addEventListener("abort", () => stage.dispose());
  const stepFrames = (count: number) => {
    const frame = performance.motion ? step(performance.motion) : 1 / 30;
    performance.rest((Math.round(performance.time / frame) + count) * frame);
  };
  const acts: Readonly<Record<string, (event: KeyboardEvent) => void>> = {
    " ": () => togglePlay(performance),
    arrowleft: ({ shiftKey }) => stepFrames(shiftKey ? -10 : -1),
    arrowright: ({ shiftKey }) => stepFrames(shiftKey ? 10 : 1),
    home: () => performance.rest(0),
    end: () => performance.rest(performance.duration),
    l: () => store.set({ loop: !store.state.loop }),
    b: () => {
      store.set({ body: store.state.body === "stick" ? "mannequin" : "stick" });
      stage.draw();
    },
    t: theme.toggle,
  };
  onKeys(acts, () => performance.shown, signal);
}

/** Play or pause; from its end a performance begins anew. */
export function togglePlay(performance: Performance): void {
  const { store, scene } = performance.session;
  const { loop, playing } = store.state;
  if (!playing && !loop && performance.time >= performance.duration - 1e-6) performance.seek(0);
  store.set({ playing: !playing });
  scene.redraw();
}

class Stage {
  figure: Figure | null = null;
  readonly #performance: Performance;
  #pose: Pose = pose(0);
  /** Model whose character is shown, and the motion that it fits. */
  #model: string | null = null;
  #motion: Performance["motion"] = null;

  constructor(performance: Performance) {
    this.#performance = performance;
  }

  /** Show the newest motion with its character. */
  async update(): Promise<void> {
    const { motion, session } = this.#performance;
    if (!motion || motion === this.#motion) return;
    const model = motion.trust.character;
    if (model !== this.#model) {
      const { notice, scene, service, signal } = session;
      try {
        const [card, { content }] = await Promise.all([
          service.client.card(model, signal),
          service.client.character(model, signal),
        ]);
        // Another motion may have come meanwhile, and shows itself.
        if (motion !== this.#performance.motion || signal.aborted) return;
        this.figure?.dispose();
        this.figure = new Figure(card, character.read(content), false);
        this.#pose = pose(card.skeleton.names.length);
        this.#model = model;
        scene.root.add(this.figure.group);
      } catch (fault) {
        if (!signal.aborted) notice(fault);
        return;
      }
    }
    this.#motion = motion;
    // The attribute on the stage tells tests that the motion has come.
    stageElement().dataset["performed"] = String(motion.times.length);
    this.draw();
  }

  draw(): void {
    const { shown, time, session } = this.#performance;
    const { scene, store } = session;
    scene.redraw();
    if (!this.figure) return;
    this.figure.wear(store.state.body);
    this.figure.group.visible = shown && this.#motion !== null;
    if (!shown || !this.#motion) return;
    sample(this.#pose, this.#motion, time);
    const offsets = this.#motion.boneOffsets;
    this.figure.show({ ...this.#pose, offsets, carried: NOWHERE });
    scene.follow(this.#pose.root[0]!, this.#pose.root[2]!);
  }

  step(seconds: number): boolean {
    const { duration, session, shown, time } = this.#performance;
    const { loop, playing, speed } = session.store.state;
    if (!shown || !playing || !this.#motion) return false;
    const next = advanced(time, seconds * speed, duration, loop);
    this.#performance.seek(next.time);
    if (!next.playing) session.store.set({ playing: false });
    return next.playing;
  }

  dispose(): void {
    this.figure?.dispose();
    delete stageElement().dataset["performed"];
  }
}

function stageElement(): HTMLElement {
  return document.querySelector<HTMLElement>("#stage")!;
}
