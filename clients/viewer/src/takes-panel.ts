/** Takes: other motions than the prediction, by a seed, and how far they deviate. */

import "./takes.css";
import { button, el, labelled } from "./dom.ts";
import { served } from "./page.ts";
import type { Session } from "./session.ts";
import type { State } from "./state.ts";
import {
  floorOf,
  HIGHEST_FLOOR,
  hasDetail,
  LARGEST_SEED,
  nextSeed,
  whyFeetCannotStand,
} from "./takes.ts";

export function mount(host: HTMLElement, session: Session): void {
  const { card, player, scene, signal, source, store } = session;
  if (!served(source)) {
    host.append(el("h2", {}, "Takes"), el("p", { class: "about" }, NONE));
    return;
  }
  const taken = el("strong", { "data-taken": "", role: "status" });
  const more = button("Next take", "Next take (N)", () =>
    store.set({ take: nextSeed(store.state.take) }),
  );
  const back = button("Prediction", "Prediction, no take (P)", () => store.set({ take: 0 }));
  const seed = seedField(store);
  const variety = varietyField(store);
  const detail = el("input", { type: "checkbox" });
  detail.addEventListener("change", () => store.set({ detail: detail.checked }));
  const details = el("label", { class: "takes-check" }, detail, el("span", {}, DETAIL));
  details.hidden = !hasDetail(card);
  const floor = floorField(store);
  floor.element.hidden = whyFeetCannotStand(card) !== null;
  const show = () => {
    const { state } = store;
    host.hidden = state.view === "crowd";
    back.setAttribute("aria-pressed", String(!state.take));
    seed.show(state.take);
    variety.show(state.variety);
    detail.checked = state.detail;
    floor.show(state);
    scene.lay(state.view === "crowd" ? 0 : floorOf(source, card, state));
  };
  host.append(
    el("div", { class: "title" }, el("h2", {}, "Takes"), el("span", {}, taken)),
    el("p", { class: "about" }, ABOUT),
    el("div", { class: "takes-row" }, more, back),
    seed.element,
    variety.element,
    details,
    floor.element,
  );
  show();
  player.onTrust(({ take }) => {
    const said = take?.seed ? `take ${take.seed}` : "the prediction";
    if (taken.textContent !== said) taken.textContent = said;
  });
  signal.addEventListener("abort", store.listen(show));
}

const NONE =
  "Other takes of the motion need a service: this page runs without one, and shows the prediction.";
const ABOUT =
  "A take deviates from the prediction as captured clips do. Equal seeds give equal takes. Sigma is that of the prediction.";
const DETAIL = "Detail: sampled by the seed, not predicted";

type Store = Session["store"];

function seedField(store: Store) {
  const field = el("input", {
    type: "number",
    min: 0,
    max: LARGEST_SEED,
    step: 1,
    class: "takes-seed",
  });
  field.addEventListener("change", () => {
    const value = Number(field.value);
    const fits =
      field.value !== "" && Number.isInteger(value) && value >= 0 && value <= LARGEST_SEED;
    if (fits) store.set({ take: value });
    else field.value = String(store.state.take);
  });
  const show = (take: number) => {
    if (Number(field.value) !== take || field.value === "") field.value = String(take);
  };
  const element = labelled("Seed", field);
  element.classList.add("takes-field");
  return { element, show };
}

function floorField(store: Store) {
  const field = el("input", {
    type: "number",
    min: -HIGHEST_FLOOR,
    max: HIGHEST_FLOOR,
    step: 0.05,
    class: "takes-seed",
  });
  field.addEventListener("change", () => {
    const value = Number(field.value);
    if (field.value !== "" && Math.abs(value) <= HIGHEST_FLOOR) store.set({ floor: value });
    else field.value = String(store.state.floor);
  });
  const show = ({ floor, stands }: Pick<State, "floor" | "stands">) => {
    if (Number(field.value) !== floor || field.value === "") field.value = String(floor);
    field.disabled = !stands;
  };
  const element = labelled("Floor, m", field);
  element.classList.add("takes-field");
  return { element, show };
}

function varietyField(store: Store) {
  const range = el("input", { type: "range", min: 0, max: 1, step: 0.05 });
  range.addEventListener("input", () => store.set({ variety: Number(range.value) }));
  const said = el("span", { class: "takes-value" });
  const element = labelled("Variety", range);
  element.classList.add("takes-field");
  element.append(said);
  const show = (variety: number) => {
    range.value = String(variety);
    said.textContent = variety.toFixed(2);
    range.setAttribute(
      "aria-valuetext",
      `${variety.toFixed(2)}, where 1 is as captured clips vary`,
    );
  };
  return { element, show };
}
