/** The clip at the sliders, played again and again; computed anew while they move. */

import type { ModelCard } from "@posefield/client";
import type { Clip, Model } from "@posefield/runtime";
import type { Character } from "../../viewer/src/character.ts";
import { Figure } from "../../viewer/src/figure.ts";
import { NOWHERE, pose, sample } from "../../viewer/src/playback.ts";
import type { Scene } from "../../viewer/src/scene.ts";
import type { View } from "./main.ts";
import type { Panel } from "./panel.ts";

export interface Stage {
  readonly scene: Scene;
  readonly model: Model;
  /** The model's card, as the drawings take it. */
  readonly card: ModelCard;
  readonly character: Character;
  readonly panel: Panel;
}

/** Time for which the end of a motion without cycle is shown, s. */
const PAUSE = 0.5;

export class ClipView implements View {
  readonly ready: Promise<void>;
  readonly #stage: Stage;
  readonly #figure: Figure;
  readonly #end = new AbortController();
  #clip: Clip | null = null;
  #time = 0;
  #computes = false;
  #changed = false;

  constructor(stage: Stage) {
    const { scene, card, character, panel } = stage;
    this.#stage = stage;
    this.#figure = new Figure(card, character, false);
    this.#figure.wear(panel.state.body);
    scene.root.add(this.#figure.group);
    scene.frame();
    const { signal } = this.#end;
    this.ready = this.#compute().then(() => scene.add((seconds) => this.#draw(seconds), signal));
  }

  change(): void {
    this.#changed = true;
    if (!this.#computes) this.#compute();
  }

  dispose(): void {
    this.#end.abort();
    this.#figure.dispose();
  }

  async #compute(): Promise<void> {
    const { model, panel, scene } = this.#stage;
    this.#computes = true;
    try {
      do {
        this.#changed = false;
        const cycle = model.card.cyclic ? ({ loop: true, root: "in_place" } as const) : {};
        const options = { ...panel.state.options, ...cycle, fps: 60 };
        this.#clip = await model.clip(panel.state.controls, options);
      } while (this.#changed);
    } finally {
      this.#computes = false;
    }
    scene.redraw();
  }

  #draw(seconds: number): boolean {
    const clip = this.#clip!;
    const whole = clip.duration + (this.#stage.model.card.cyclic ? 0 : PAUSE);
    this.#time = (this.#time + seconds) % whole;
    const out = sample(pose(clip.names.length), clip, Math.min(this.#time, clip.duration));
    this.#figure.show({ ...out, offsets: clip.boneOffsets, carried: NOWHERE });
    this.#stage.scene.follow(out.root[0]!, out.root[2]!);
    return true;
  }
}
