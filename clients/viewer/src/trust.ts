/** What the answer is worth: sigma, whether anything like it was captured, what lies outside, and the
 * captured clips that it is made of. */

import type { ModelCard, Reasons, Trust } from "@posefield/client";

import { named, SCALE, worded } from "./bands.ts";
import { el } from "./dom.ts";
import { says as feetSay } from "./feet-words.ts";
import { Latest } from "./latest.ts";
import { items, marks } from "./marks.ts";
import { served } from "./page.ts";
import type { Session } from "./session.ts";
import { title } from "./slider.ts";
import * as written from "./written.ts";

/** How many captured clips are named. */
const NEAREST = 4;
/** Milliseconds without a new answer until somebody asks why, and until it is said aloud. */
const CALM = 160;

type Captured = Reasons["nearest"][number];

export function mount(host: HTMLElement, session: Session): void {
  const { card, player, signal, source, store } = session;
  const sigma = el("strong", { "data-sigma": "" }, "…");
  const band = el("span", { "data-band": "", title: "One scale for all models" });
  const known = el("ul", { class: "marks", "aria-label": "What was captured" });
  const sentence = el("p", { class: "sentence" });
  const warnings = el("ul", { class: "warnings" });
  const list = el("ol", { class: "nearest" });
  const others = el("p", { class: "about" });
  const feet = el("p", { class: "about", "data-feet": "" });
  const aloud = el("p", { class: "unseen", "aria-live": "polite" });
  const meter = el("meter", { min: 0, max: 1, "aria-hidden": "true" });
  host.append(
    el(
      "div",
      { class: "title" },
      el("h2", {}, "Trust"),
      el("span", { class: "sigma" }, "σ ", sigma, " ", band),
    ),
    meter,
    known,
    sentence,
    warnings,
    feet,
    aloud,
  );
  if (served(source)) host.append(el("h3", {}, "Made of these captured clips"), list, others);
  const why = new Latest<null>(async () => {
    const { controls, labels, model, performer } = store.state;
    const question = { controls, performer, labels, nearest: NEAREST };
    const reasons = await source.why(model, question, signal).catch(() => null);
    if (!reasons || signal.aborted) return;
    list.replaceChildren(...reasons.nearest.map((clip) => item(clip, card, session)));
    others.textContent = rest(reasons);
  });
  let timer: ReturnType<typeof setTimeout> | undefined;
  signal.addEventListener("abort", () => clearTimeout(timer));
  // A single pose says nothing of feet: they are placed over a whole clip.
  player.onClip(({ trust }) => {
    feet.textContent = feetSay(card, store.state.stands, trust.feet, served(source));
  });
  const crowded = () => {
    // Nor are they placed in crowds.
    feet.hidden = store.state.view === "crowd";
  };
  crowded();
  signal.addEventListener("abort", store.listen(crowded));
  player.onTrust((trust) => {
    sigma.textContent = written.centimetres(trust.sigma);
    // Services older than 3.1.0, and single poses in place, say no band.
    band.textContent = trust.band ? named(trust.band) : "";
    meter.value = Math.min(1, trust.sigma / SCALE);
    known.replaceChildren(...items(trust));
    sentence.textContent = says(trust);
    warnings.replaceChildren(...trust.warnings.map((text) => el("li", {}, text)));
    host.toggleAttribute("data-outside", trust.warnings.length > 0);
    clearTimeout(timer);
    timer = setTimeout(() => {
      if (served(source)) why.ask(null);
      const told = marks(trust).map(({ words }) => `${words}.`);
      aloud.textContent = [says(trust), ...told, ...trust.warnings].join(" ");
    }, CALM);
  });
}

function says(trust: Trust): string {
  const found = `A captured clip here would lie about ${written.centimetres(trust.sigma)} away, joint by joint.`;
  // Services older than 2.2.0 warn of what lies outside, and say no more.
  if (!(trust.supported ?? !trust.warnings.length)) return `${found} That is a guess.`;
  return trust.band ? `${found} That is ${worded(trust.band)}.` : found;
}

function item(clip: Captured, card: ModelCard, { store }: Session): HTMLElement {
  const values = card.controls.map(({ name, unit, minimum, maximum }) => {
    const value = written.short(clip.controls[name]!, maximum - minimum);
    return `${title(name).toLowerCase()} ${value} ${unit}`;
  });
  const go = el(
    "button",
    { type: "button", title: `Go there: ${values.join(", ")}` },
    el("span", { class: "source" }, clip.source),
    el("span", { class: "weight" }, percent(share(clip))),
    el("meter", { min: 0, max: 1, value: share(clip), "aria-hidden": "true" }),
    el("span", { class: "about" }, `distance ${clip.distance.toFixed(2)}${who(clip)}`),
  );
  go.addEventListener("click", () =>
    store.set({
      controls: { ...clip.controls },
      performer: clip.performer,
      labels: { ...clip.labels },
    }),
  );
  return el("li", {}, go);
}

function who({ performer, labels = {} }: Captured): string {
  const names = [...(performer ? [performer] : []), ...Object.values(labels)];
  return names.map((name) => ` · ${name}`).join("");
}

/** Part of the clip in the positive weights; services older than 3.1.0 say the weight alone. */
function share(clip: { readonly share?: number; readonly weight: number }): number {
  return clip.share ?? Math.max(0, clip.weight);
}

function rest({ others }: Reasons): string {
  return others.count ? `${others.count} others together ${percent(share(others))}` : "";
}

function percent(share: number): string {
  return `${(100 * share).toFixed(Math.abs(share) < 0.1 ? 1 : 0)} %`;
}
