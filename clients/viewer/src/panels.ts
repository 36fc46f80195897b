/** Small panels: display of the body, takes and floor, curves, and level of detail. */

import {
  button,
  checkbox,
  choice,
  chooser,
  el,
  labelled,
  numberField,
  titled,
  toggle,
} from "./dom.ts";
import type { Session } from "./player.ts";
import {
  floorOf,
  HIGHEST_FLOOR,
  hasDetail,
  LARGEST_SEED,
  nextSeed,
  whyFeetCannotStand,
} from "./questions.ts";

/** Display of the body, over the stage. */
export function mountOptions(host: HTMLElement, { card, signal, store }: Session): void {
  const body = choice(
    "Body",
    [
      ["mannequin", "Mannequin"],
      ["stick", "Sticks"],
    ],
    (value) => store.set({ body: value }),
  );
  const toggles = [
    ["ghost", "Ghost", "Ghost of the nearest example"],
    ["fan", "Fan", "Fan of other takes (V)"],
    ["feet", "Contacts", "Contacts and skate of the feet (F)"],
    ["stands", "Feet stand", "Feet stand, or are as predicted (S)"],
  ] as const;
  const buttons = toggles.map(
    ([key, text, label]) => [key, toggle(text, label, (on) => store.set({ [key]: on }))] as const,
  );
  const root = toggle("Root motion", "Root motion: the body travels", (on) =>
    store.set({ root: on ? "travelling" : "in_place" }),
  );
  buttons[3]![1].hidden = whyFeetCannotStand(card) !== null;
  root.hidden = card.root === "in_place";
  host.append(body, ...buttons.map(([, element]) => element), root);
  store.follow((state) => {
    body.set(state.body);
    for (const [key, element] of buttons) element.set(state[key]);
    root.set(state.root === "travelling");
    host.hidden = state.view !== "one";
  }, signal);
}

/** Takes, by a seed, and how far they deviate; height of the floor. */
export function mountTakes(host: HTMLElement, session: Session): void {
  const { card, player, scene, signal, store } = session;
  const taken = el("strong", { "data-taken": "", role: "status" });
  const next = button("Next take", "Next take (N)", () =>
    store.set({ take: nextSeed(store.state.take) }),
  );
  const back = button("Prediction", "Prediction, no take (P)", () => store.set({ take: 0 }));
  const seed = stateNumber(session, "take", "Seed", { min: 0, max: LARGEST_SEED, step: 1 });
  const floor = stateNumber(session, "floor", "Floor, m", FLOOR);
  floor.hidden = whyFeetCannotStand(card) !== null;
  const detail = checkbox("Detail: sampled by the seed, not predicted", (on) =>
    store.set({ detail: on }),
  );
  detail.hidden = !hasDetail(card);
  const range = el("input", { type: "range", min: 0, max: 1, step: 0.05 });
  range.addEventListener("input", () => store.set({ variety: Number(range.value) }));
  const variety = labelled("Variety", range);
  const value = el("span", { class: "value" });
  variety.append(value);
  host.append(
    titled("Takes", el("span", {}, taken)),
    el("p", { class: "about" }, TAKES),
    el("div", { class: "row" }, next, back),
    ...[seed, variety, detail, floor],
  );
  store.follow((state) => {
    host.hidden = state.view === "crowd";
    back.setAttribute("aria-pressed", String(!state.take));
    range.value = String(state.variety);
    value.textContent = state.variety.toFixed(2);
    const text = `${state.variety.toFixed(2)}, where 1 is as captured clips vary`;
    range.setAttribute("aria-valuetext", text);
    detail.set(state.detail);
    floor.querySelector("input")!.disabled = !state.stands;
    scene.setFloor(state.view === "crowd" ? 0 : floorOf(card, state));
  }, signal);
  player.onTrust(({ take }) => {
    const text = take?.seed ? `take ${take.seed}` : "the prediction";
    if (taken.textContent !== text) taken.textContent = text;
  });
}

const FLOOR = { min: -HIGHEST_FLOOR, max: HIGHEST_FLOOR, step: 0.05 };
const TAKES =
  "A take deviates from the prediction as captured clips do. Equal seeds give equal takes. Sigma is that of the prediction.";

function stateNumber(
  { signal, store }: Session,
  key: "take" | "floor",
  label: string,
  range: Readonly<Record<"min" | "max" | "step", number>>,
): HTMLElement {
  const field = numberField(label, range, (value) => store.set({ [key]: value }));
  store.follow((state) => field.set(state[key]), signal);
  return field;
}

/** A bar for each curve of the model, such as weights of blend shapes. */
export function mountCurves(host: HTMLElement, { card, player }: Session): void {
  const curves = card.curves ?? [];
  host.hidden = curves.length === 0;
  if (!curves.length) return;
  const bars = curves.map(({ name, minimum, maximum }) => {
    const meter = el("meter", { min: minimum, max: maximum, "aria-label": name });
    const value = el("output", { "data-curve": name }, "…");
    return { meter, value, row: el("li", {}, el("span", { title: name }, name), meter, value) };
  });
  host.append(el("h2", {}, "Curves"), el("ul", { class: "curves" }, ...bars.map(({ row }) => row)));
  player.watch(({ curves: values }) => {
    bars.forEach(({ meter, value }, index) => {
      const now = values?.[index];
      if (now === undefined) return;
      meter.value = now;
      value.textContent = now.toFixed(2);
    });
  });
}

/** Choice of the level of detail, and comparison of all on the stage. */
export function mountDetail(host: HTMLElement, { card, signal, store }: Session): void {
  const names = card.levels.map(
    (_, level) => [String(level), level ? String(level) : "0, finest"] as const,
  );
  const level = chooser(names, "0", (value) => store.set({ level: Number(value) }));
  const compare = toggle("Compare all", "Compare all", (on) =>
    store.set({ view: on ? "levels" : "one" }),
  );
  host.append(
    el("h2", {}, "Detail"),
    el("p", { class: "about" }, DETAIL),
    el("div", { class: "row" }, labelled("Level", level), compare),
  );
  store.follow((state) => {
    level.value = String(state.level);
    compare.set(state.view === "levels");
  }, signal);
}

const DETAIL =
  "Coarser levels cost less and differ slightly from level 0. They are meant for characters far from the camera.";
