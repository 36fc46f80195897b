/** Trust in the answer: sigma, support, warnings, feet, and the captured clips behind it. */

import type { ModelCard, Reasons, Trust } from "@posefield/client";

import { el, icon } from "./dom.ts";
import { Latest } from "./latest.ts";
import type { Session } from "./player.ts";
import { whyFeetCannotStand } from "./questions.ts";
import * as written from "./written.ts";

/** Number of captured clips that are named. */
const NEAREST = 4;
/** Milliseconds without a new answer until the captured clips are asked for, and screen readers told. */
const CALM = 160;
/** Sigma at which the meter is full, m. */
const SCALE = 0.2;
/** Distances below are left out of sentences, m. */
const SLIGHT = 0.0005;
/** Limits of the contract's `Band`. */
const LIMITS: Readonly<Record<string, string>> = {
  close: "up to 3 cm",
  near: "3 to 7.5 cm",
  rough: "7.5 to 15 cm",
  guess: "more than 15 cm",
};

type Captured = Reasons["nearest"][number];

export function mount(host: HTMLElement, session: Session): void {
  const { card, player, service, signal, store } = session;
  const sigma = el("strong", { "data-sigma": "" }, "…");
  const band = el("span", { "data-band": "", title: "One scale for all models" });
  const meter = el("meter", { min: 0, max: 1, "aria-hidden": "true" });
  const known = el("ul", { class: "marks", "aria-label": "What was captured" });
  const sentence = el("p", { class: "sentence" });
  const warnings = el("ul", { class: "warnings" });
  const feet = el("p", { class: "about", "data-feet": "" });
  const aloud = el("p", { class: "unseen", "aria-live": "polite" });
  const list = el("ol", { class: "nearest" });
  const others = el("p", { class: "about" });
  host.append(
    el(
      "div",
      { class: "title" },
      el("h2", {}, "Trust"),
      el("span", { class: "sigma" }, "σ ", sigma, " ", band),
    ),
    ...[meter, known, sentence, warnings, feet, aloud],
    el("h3", {}, "Made of these captured clips"),
    ...[list, others],
  );
  const why = new Latest<null>(async () => {
    const { controls, labels, model, performer } = store.state;
    const question = { controls, performer, labels, nearest: NEAREST };
    const reasons = await service.client.why(model, question, signal).catch(() => null);
    if (reasons?.model !== card.identity || signal.aborted) return;
    list.replaceChildren(...reasons.nearest.map((clip) => item(clip, card, session)));
    const { count } = reasons.others;
    others.textContent = count
      ? `${count} others together ${percent(reasons.others.share ?? 0)}`
      : "";
  });
  let timer: ReturnType<typeof setTimeout> | undefined;
  signal.addEventListener("abort", () => clearTimeout(timer));
  // A single pose says nothing of feet: they are placed over a whole clip.
  player.onClip(({ trust }) => {
    feet.textContent = feetSentence(card, store.state.stands, trust.feet);
  });
  // Nor are they placed in crowds.
  store.follow(({ view }) => {
    feet.hidden = view === "crowd";
  }, signal);
  player.onTrust((trust) => {
    const facts = marks(trust);
    const text = trustSentence(trust);
    sigma.textContent = written.centimetres(trust.sigma);
    band.textContent = bandName(bandOf(trust) ?? "");
    meter.value = Math.min(1, trust.sigma / SCALE);
    // The signs differ in shape, for users who do not tell the colours apart.
    known.replaceChildren(
      ...facts.map(({ of, yes, words }) =>
        el(
          "li",
          { "data-mark": of, "data-held": yes ? "yes" : "no" },
          icon(SIGNS[of][yes ? 0 : 1]),
          words,
        ),
      ),
    );
    sentence.textContent = text;
    warnings.replaceChildren(...trust.warnings.map((text) => el("li", {}, text)));
    host.toggleAttribute("data-outside", trust.warnings.length > 0);
    clearTimeout(timer);
    timer = setTimeout(() => {
      why.ask(null);
      const spoken = [text, ...facts.map(({ words }) => `${words}.`), ...trust.warnings];
      aloud.textContent = spoken.join(" ");
    }, CALM);
  });
}

const bandName = (band: string): string => (band === "guess" ? "a guess" : band);

/** Return the worse of the band of sigma and that of the support. */
const bandOf = ({ supported, band }: Trust) => (supported === false ? "guess" : band);

function trustSentence(trust: Trust): string {
  const text = `A captured clip here would lie about ${written.centimetres(trust.sigma)} away, joint by joint.`;
  const band = bandOf(trust);
  if (!band) return text;
  if (band !== trust.band) return `${text} That is a guess: nothing like it was captured.`;
  const limits = LIMITS[band];
  return `${text} That is ${limits ? `${bandName(band)}: ${limits}` : band}.`;
}

const SIGNS = { support: ["held", "gap"], performer: ["somebody", "nobody"] } as const;

interface Mark {
  readonly of: keyof typeof SIGNS;
  readonly yes: boolean;
  readonly words: string;
}

/** Return whether similar clips were captured, and, of models with performers, whether this one was. */
export function marks({
  supported,
  performer_seen: seen,
  performer,
}: Pick<Trust, "supported" | "performer_seen" | "performer">): Mark[] {
  const facts: Mark[] = [];
  if (supported !== undefined) {
    const words = supported ? "Captured near here" : "Nothing like it was captured";
    facts.push({ of: "support", yes: supported, words });
  }
  if (seen !== undefined) {
    const words = seen
      ? `${performer ?? "The performer"} was captured`
      : "Moves as an unseen performer";
    facts.push({ of: "performer", yes: seen, words });
  }
  return facts;
}

/** A captured clip with its share in the answer, as a button that goes there. */
function item(clip: Captured, card: ModelCard, { store }: Session): HTMLElement {
  const { controls, distance, performer, share = 0, source } = clip;
  const labels = clip.labels ?? {};
  const values = card.controls.map(({ name, unit, minimum, maximum }) => {
    const value = written.short(controls[name]!, maximum - minimum);
    return `${written.title(name).toLowerCase()} ${value} ${unit}`;
  });
  const names = [...(performer ? [performer] : []), ...Object.values(labels)];
  const go = el(
    "button",
    { type: "button", title: `Go there: ${values.join(", ")}` },
    el("span", { class: "source" }, source),
    el("span", { class: "weight" }, percent(share)),
    el("meter", { min: 0, max: 1, value: share, "aria-hidden": "true" }),
    el("span", { class: "about" }, [`distance ${distance.toFixed(2)}`, ...names].join(" · ")),
  );
  go.addEventListener("click", () =>
    store.set({ controls: { ...controls }, performer, labels: { ...labels } }),
  );
  return el("li", {}, go);
}

function percent(share: number): string {
  return `${(100 * share).toFixed(Math.abs(share) < 0.1 ? 1 : 0)} %`;
}

/** Say what the service did to the feet of a clip, or why nothing. */
export function feetSentence(
  card: Pick<ModelCard, "feet" | "root">,
  stands: boolean,
  feet: Trust["feet"],
): string {
  if (!feet) {
    const why = whyFeetCannotStand(card);
    if (why) return `Feet as predicted: ${why}.`;
    return stands
      ? "Feet as predicted: the service did not say that they stand."
      : "Feet as predicted.";
  }
  const { stances, swings, left, skate, skate_before: before, drift, lowered, grounded } = feet;
  const others = left.map((text) => ` ${/[.!?]$/.test(text) ? text : `${text}.`}`).join("");
  if (!stances.length) return `Feet as predicted: none could be placed.${others}`;
  const count = (number: number, word: string) => `${number} ${word}${number === 1 ? "" : "s"}`;
  const speed = (value: number) => `${(100 * value).toFixed(1)} cm/s`;
  const { centimetres } = written;
  const parts = [
    `${count(stances.length, "stance")}, ${count(swings, "swing")}`,
    `skate ${speed(before)} before, ${speed(skate)} now`,
    ...(drift > SLIGHT ? [`off its place by up to ${centimetres(drift)}`] : []),
    lowered > SLIGHT ? `pelvis lowered by up to ${centimetres(lowered)}` : "pelvis not lowered",
  ];
  if (Math.abs(grounded) > SLIGHT) {
    const way = grounded > 0 ? "lowered" : "raised";
    parts.push(`body ${way} to the floor by ${centimetres(Math.abs(grounded))}`);
  }
  return `Feet stand: ${parts.join("; ")}.${others}`;
}
