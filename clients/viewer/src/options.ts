/** How the body is shown: over the stage, where one looks. */

import { choice, toggle } from "./dom.ts";
import { type Mount, served } from "./page.ts";

export const mount: Mount = (host, { card, signal, source, store }) => {
  const body = choice(
    "Body",
    [
      ["mannequin", "Mannequin"],
      ["stick", "Sticks"],
    ],
    (value) => store.set({ body: value }),
  );
  const ghost = toggle("Ghost", "Ghost of the nearest example", (on) => store.set({ ghost: on }));
  const feet = toggle("Feet", "Feet: contacts and skate", (on) => store.set({ feet: on }));
  const root = toggle("Root motion", "Root motion: the body travels", (on) =>
    store.set({ root: on ? "travelling" : "in_place" }),
  );
  ghost.hidden = !served(source);
  root.hidden = card.root === "in_place";
  const show = () => {
    const { state } = store;
    body.set(state.body);
    ghost.set(state.ghost);
    feet.set(state.feet);
    root.set(state.root === "travelling");
    host.hidden = state.view !== "one";
  };
  host.append(body, ghost, feet, root);
  show();
  signal.addEventListener("abort", store.listen(show));
};
