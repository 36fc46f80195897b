/** The bar at the top, the buttons that lead to sections of the side, and the hint of a first visit. */

import type { ModelSummary } from "@posefield/client";

import { button, choice, el, icon, id, recall, remember, textButton } from "./dom.ts";
import type { Session } from "./player.ts";
import { has, type Store, type View } from "./state.ts";
import * as theme from "./theme.ts";

const VIEWS = [
  ["one", "Single"],
  ["crowd", "Crowd"],
  ["performance", "Performance"],
] as const;
const KEYS = [
  ["Space", "play or pause"],
  ["← →", "one frame back or forward"],
  ["Shift ← →", "ten frames"],
  ["Home End", "first or last frame"],
  ["R", "reset all controls"],
  ["L", "loop"],
  ["G", "ghost of the nearest example"],
  ["N", "next take"],
  ["P", "back to the prediction"],
  ["V", "fan of other takes"],
  ["S", "feet stand, or are as predicted"],
  ["F", "contacts and skate of the feet"],
  ["B", "mannequin or sticks"],
  ["T", "light or dark"],
] as const;
const DRAG =
  "Drag turns the view, the wheel or two fingers bring it nearer, the right button or two fingers move it.";
/** Milliseconds for which a button says that the link is copied. */
const COPIED = 2500;

export class Header {
  readonly #models = el("select", { id: id() });
  readonly #about = el("p", { class: "about", "data-about": "" });
  readonly #views: ReturnType<typeof choice<View>>;
  #store: Store | null = null;

  /** open: called with the name of the chosen model. */
  constructor(host: HTMLElement, open: (model: string) => void) {
    this.#models.addEventListener("change", () => open(this.#models.value));
    this.#views = choice<View>("View", VIEWS, (view) => this.#store?.set({ view }));
    const rows = KEYS.flatMap(([key, text]) => [
      el("dt", {}, el("kbd", {}, key)),
      el("dd", {}, text),
    ]);
    const links = [
      ["/docs", "API"],
      ["/problems", "Errors"],
    ].map(([href, name]) => el("a", { href: href! }, name!));
    const help = el(
      "div",
      { popover: "auto", id: id(), class: "help", role: "dialog", "aria-label": "Keys" },
      el("h2", {}, "Keys"),
      el("dl", {}, ...rows),
      el("p", { class: "about" }, DRAG),
    );
    host.append(
      el("h1", {}, "posefield"),
      el("span", { class: "field" }, el("label", { for: this.#models.id }, "Model"), this.#models),
      this.#about,
      this.#views,
      shareButton(),
      button(icon("light"), "Light or dark (T)", theme.toggle),
      el("button", { type: "button", popovertarget: help.id, class: "sign" }, "Keys"),
      el("nav", { class: "links", "aria-label": "Documentation" }, ...links),
      help,
    );
  }

  list(models: readonly ModelSummary[], shown: string): void {
    const names = models.map(({ name }) => name);
    const all = names.includes(shown) ? names : [shown, ...names];
    const before = [...this.#models.options].map(({ value }) => value);
    if (before.join("\n") !== all.join("\n"))
      this.#models.replaceChildren(...all.map((name) => el("option", { value: name }, name)));
    this.#models.value = shown;
    this.#about.textContent = models.find(({ name }) => name === shown)?.description ?? "";
  }

  /** Name the shown model, where another was chosen and never came. */
  choose(shown: string): void {
    this.#models.value = shown;
  }

  follow(store: Store, signal: AbortSignal): void {
    this.#store = store;
    store.follow(({ view }) => this.#views.set(view), signal);
  }
}

function shareButton(): HTMLButtonElement {
  const name = "Copy link";
  let timer: ReturnType<typeof setTimeout> | undefined;
  const element = textButton(
    name,
    async () => {
      const copied = await navigator.clipboard?.writeText(location.href).then(
        () => true,
        () => false,
      );
      element.textContent = copied ? "Copied" : "Copy the address bar";
      clearTimeout(timer);
      timer = setTimeout(() => {
        element.textContent = name;
      }, COPIED);
    },
    "share",
  );
  element.setAttribute("aria-live", "polite");
  return element;
}

const SECTIONS = [
  ["controls", "Controls"],
  ["map", "Map"],
  ["files", "Download"],
  ["detail", "Detail"],
] as const;

/** Buttons that scroll to sections, always in view; that of the section on top is marked. */
export function mountJumps(host: HTMLElement, { signal, store }: Session): void {
  const side = host.parentElement!;
  const section = (part: string) => side.querySelector<HTMLElement>(`[data-part="${part}"]`)!;
  /** Sections near the end cannot come to the top. */
  let chosen = { part: "", scroll: -1 };
  const buttons = SECTIONS.map(([part, name]) => {
    const element = textButton(name, () => {
      // The keyboard goes on from there.
      section(part).tabIndex = -1;
      section(part).focus({ preventScroll: true });
      section(part).scrollIntoView();
      chosen = { part, scroll: side.scrollTop };
      mark();
    });
    element.dataset["to"] = part;
    return element;
  });
  const mark = () => {
    const edge = host.getBoundingClientRect().bottom + 60;
    const begun = SECTIONS.filter(([part]) => section(part).getBoundingClientRect().top < edge);
    const top = chosen.scroll === side.scrollTop ? chosen.part : (begun.at(-1)?.[0] ?? "controls");
    for (const button of buttons)
      button.setAttribute("aria-current", String(button.dataset["to"] === top));
  };
  buttons[0]!.setAttribute("aria-current", "true");
  side.addEventListener("scroll", mark, { signal });
  store.listen((_, changed) => {
    if (changed.has("view")) side.scrollTop = 0;
  }, signal);
  host.append(el("nav", { class: "jumps", "aria-label": "Sections" }, ...buttons));
}

const WELCOMED = "posefield-welcomed";

/** A hint on the first visit, until it is closed or a control is moved. */
export function mountWelcome(host: HTMLElement, { signal, store }: Session): void {
  host.hidden = recall("localStorage", WELCOMED) !== null;
  if (host.hidden) return;
  const close = () => {
    remember("localStorage", WELCOMED, "yes");
    host.hidden = true;
  };
  const hint = "Move a slider and the motion follows. Download it for Blender, Unreal or Maya.";
  host.append(
    el(
      "div",
      { class: "welcome title", role: "note" },
      el("div", {}, el("h2", {}, "Motion from a few sliders"), el("p", {}, hint)),
      button("Close", "Close this hint", close),
    ),
  );
  store.listen((_, changed) => {
    if (has(changed, "controls", "performer", "labels")) close();
  }, signal);
}
