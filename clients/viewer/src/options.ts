/** How the body is shown: over the stage, where one looks. */

import { choice, toggle } from "./dom.ts";
import { type Mount, served } from "./page.ts";
import { whyFeetCannotStand } from "./takes.ts";

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
  const fan = toggle("Fan", "Fan of other takes (V)", (on) => store.set({ fan: on }));
  const feet = toggle("Contacts", "Contacts and skate of the feet (F)", (on) =>
    store.set({ feet: on }),
  );
  const stand = toggle("Feet stand", "Feet stand, or are as predicted (S)", (on) =>
    store.set({ stands: on }),
  );
  const root = toggle("Root motion", "Root motion: the body travels", (on) =>
    store.set({ root: on ? "travelling" : "in_place" }),
  );
  ghost.hidden = fan.hidden = !served(source);
  stand.hidden = !served(source) || whyFeetCannotStand(card) !== null;
  root.hidden = card.root === "in_place";
  const show = () => {
    const { state } = store;
    body.set(state.body);
    ghost.set(state.ghost);
    fan.set(state.fan);
    feet.set(state.feet);
    stand.set(state.stands);
    root.set(state.root === "travelling");
    host.hidden = state.view !== "one";
  };
  host.append(body, ghost, fan, feet, stand, root);
  show();
  signal.addEventListener("abort", store.listen(show));
};
