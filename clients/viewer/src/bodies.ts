/** The body that is asked for, on the stage; the camera goes along with it. */

import { Figure } from "./figure.ts";
import type { Session } from "./session.ts";
import * as theme from "./theme.ts";

export function mount({ card, player, scene, signal, store }: Session): void {
  const figure = new Figure(card, false);
  scene.root.add(figure.group);
  const dress = () => {
    figure.wear(store.state.body);
    figure.group.visible = store.state.view === "one";
    scene.redraw();
  };
  dress();
  player.watch((shown) => {
    figure.show(shown);
    const { x, z } = figure.group.localToWorld(centre(figure, shown.root));
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

function centre(figure: Figure, root: Float32Array) {
  figure.group.updateMatrixWorld();
  return figure.group.position.clone().fromArray(root);
}
