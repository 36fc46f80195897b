/** The page: who answers, what is shown, and the parts in their places. */

import { Client } from "@posefield/client";

import "./style.css";
import type { Page } from "./page.ts";
import { Scene } from "./scene.ts";
import { Store } from "./state.ts";

async function start(): Promise<void> {
  const source = new Client("");
  const [model] = await source.models();
  const card = await source.card(model!.name);
  const controls = Object.fromEntries(
    card.controls.map((control) => [control.name, control.default]),
  );
  const [across = "", along = ""] = card.controls.map((control) => control.name);
  const store = new Store({
    model: model!.name,
    controls,
    performer: null,
    level: 0,
    time: 0,
    playing: true,
    speed: 1,
    loop: true,
    root: "travelling",
    body: "mannequin",
    ghost: false,
    feet: false,
    view: "one",
    across,
    along,
  });
  const page: Page = {
    store,
    source,
    card,
    scene: new Scene(document.querySelector("#stage")!),
    notice: console.error,
    signal: new AbortController().signal,
  };
  page.scene.redraw();
}

void start();
