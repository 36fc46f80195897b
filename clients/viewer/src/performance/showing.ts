/** The body of a performance on the stage: it plays, and the camera goes along. */

import type { ModelCard } from "@posefield/client";

import * as character from "../character.ts";
import { Figure } from "../figure.ts";
import { taken } from "../keys.ts";
import { advanced, NOWHERE, type Pose, pose, sample, step } from "../playback.ts";
import * as theme from "../theme.ts";
import type { Performed } from "./answers.ts";
import type { Desk } from "./desk.ts";

export function mount(desk: Desk): void {
  const showing = new Showing(desk);
  const { scene, signal } = desk.session;
  const stop = scene.add((seconds) => showing.step(seconds));
  desk.listen((change) => {
    if (change === "answer") void showing.dress();
    if (change === "time" || change === "shown") showing.draw();
  });
  theme.listen(() => showing.tint(), signal);
  document.addEventListener("keydown", (event) => press(desk, event), { signal });
  signal.addEventListener("abort", () => {
    stop();
    showing.dispose();
  });
}

class Showing {
  readonly #desk: Desk;
  #figure: Figure | null = null;
  #pose: Pose = pose(0);
  #model: string | null = null;
  #performed: Performed | null = null;

  constructor(desk: Desk) {
    this.#desk = desk;
  }

  /** Puts on the character of the newest motion. */
  async dress(): Promise<void> {
    const { performed, session } = this.#desk;
    if (!performed || performed === this.#performed) return;
    const model = performed.report.character;
    if (model !== this.#model) {
      const { source, signal } = session;
      try {
        const [card, { content }] = await Promise.all([
          source.card(model, signal),
          source.character(model, signal),
        ]);
        // Another motion may have come meanwhile, and dresses for itself.
        if (performed !== this.#desk.performed || signal.aborted) return;
        this.#change(model, card, character.read(content));
      } catch (fault) {
        if (!signal.aborted) session.notice(fault);
        return;
      }
    }
    this.#performed = performed;
    document.querySelector<HTMLElement>("#stage")!.dataset["performed"] = String(
      performed.track.times.length,
    );
    this.draw();
  }

  draw(): void {
    const { shown, time, session } = this.#desk;
    const [figure, performed] = [this.#figure, this.#performed];
    session.scene.redraw();
    if (!figure) return;
    figure.wear(session.store.state.body);
    figure.group.visible = shown && performed !== null;
    if (!shown || !performed) return;
    sample(this.#pose, performed.track, time);
    figure.show({ ...this.#pose, offsets: performed.offsets, carried: NOWHERE });
    if (this.#desk.follows) session.scene.follow(this.#pose.root[0]!, this.#pose.root[2]!);
  }

  step(seconds: number): boolean {
    const { duration, session, shown, time } = this.#desk;
    const { loop, playing, speed } = session.store.state;
    if (!shown || !playing || !this.#performed) return false;
    const next = advanced(time, seconds * speed, duration, loop);
    this.#desk.seek(next.time);
    if (!next.playing) session.store.set({ playing: false });
    return next.playing;
  }

  tint(): void {
    this.#figure?.tint();
  }

  dispose(): void {
    this.#figure?.dispose();
    delete document.querySelector<HTMLElement>("#stage")!.dataset["performed"];
  }

  #change(model: string, card: ModelCard, skin: character.Character): void {
    this.#figure?.dispose();
    this.#figure = new Figure(card, skin, false);
    this.#pose = pose(card.skeleton.names.length);
    this.#model = model;
    this.#desk.session.scene.root.add(this.#figure.group);
  }
}

/** From the end it begins anew. */
export function togglePlay(desk: Desk): void {
  const { store, scene } = desk.session;
  const { loop, playing } = store.state;
  if (!playing && !loop && desk.time >= desk.duration - 1e-6) desk.seek(0);
  store.set({ playing: !playing });
  scene.redraw();
}

/** Shows that time, and rests there. */
export function rest(desk: Desk, time: number): void {
  desk.session.store.set({ playing: false });
  desk.seek(time);
}

export function frames(desk: Desk, count: number): void {
  const frame = desk.performed ? step(desk.performed.track) : 1 / 30;
  rest(desk, (Math.round(desk.time / frame) + count) * frame);
}

function press(desk: Desk, event: KeyboardEvent): void {
  if (!desk.shown) return;
  const { store } = desk.session;
  const acts: Readonly<Record<string, () => void>> = {
    " ": () => togglePlay(desk),
    arrowleft: () => frames(desk, event.shiftKey ? -10 : -1),
    arrowright: () => frames(desk, event.shiftKey ? 10 : 1),
    home: () => rest(desk, 0),
    end: () => rest(desk, desk.duration),
    l: () => store.set({ loop: !store.state.loop }),
    b: () => {
      store.set({ body: store.state.body === "stick" ? "mannequin" : "stick" });
      desk.seek(desk.time);
    },
    t: theme.toggle,
  };
  const key = event.key.toLowerCase();
  const act = acts[key];
  if (!act || event.ctrlKey || event.metaKey || event.altKey || taken(event.target, key)) return;
  event.preventDefault();
  act();
}
