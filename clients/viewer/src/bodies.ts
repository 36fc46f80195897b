/** The body that is asked for, on the stage; the camera goes along with it. */

import type { ModelCard } from "@posefield/client";

import { Figure } from "./figure.ts";
import type { Session } from "./session.ts";
import * as theme from "./theme.ts";

/** Largest extent of a person's joints at rest, m. */
const PERSON = 1.5;

export function mount({ card, character, player, scene, signal, store }: Session): void {
  const figure = new Figure(card, character, false);
  scene.root.add(figure.group);
  const dress = () => {
    figure.wear(store.state.body);
    figure.group.visible = store.state.view === "one";
    scene.redraw();
  };
  dress();
  const scale = span(card.skeleton) / PERSON;
  let unusual = scale < 0.5 || scale > 1.5;
  player.watch((shown) => {
    figure.show(shown);
    const { x, y, z } = figure.group.localToWorld(centre(figure, shown.root));
    // Before the first answer the body is at rest, wherever that is.
    if (unusual && player.trust) {
      scene.frame(scale, y);
      unusual = false;
    }
    if (figure.group.visible) scene.follow(x, z);
  });
  theme.listen(() => figure.tint(), signal);
  const leave = store.listen((_, changed) => {
    if (changed.has("body") || changed.has("view")) dress();
  });
  signal.addEventListener("abort", () => {
    leave();
    figure.dispose();
  });
}

/** Largest extent of a body at rest, m, of its joints. */
function span({ parents, offsets }: ModelCard["skeleton"]): number {
  const places: number[][] = [];
  for (const [joint, parent] of parents.entries())
    places.push(offsets[joint]!.map((part, axis) => part + (places[parent]?.[axis] ?? 0)));
  const sizes = [0, 1, 2].map((axis) => {
    const along = places.map((place) => place[axis]!);
    return Math.max(...along) - Math.min(...along);
  });
  return Math.max(0.05, ...sizes);
}

function centre(figure: Figure, root: Float32Array) {
  figure.group.updateMatrixWorld();
  return figure.group.position.clone().fromArray(root);
}
