/** The page: who answers, what is shown, and the parts in their places. */

import { Client } from "@posefield/client";

import "./style.css";
import { mount as mountCrowd } from "./crowd.ts";
import { mount as mountFiles } from "./files.ts";
import { mount as mountLevels } from "./levels.ts";
import { mount as mountMap } from "./map.ts";
import { offline } from "./offline.ts";
import type { Page, Source } from "./page.ts";
import { Scene } from "./scene.ts";
import { Store, type View } from "./state.ts";

async function start(): Promise<void> {
  const source: Source = (await offline()) ?? new Client("");
  const [name, rest] = location.hash.slice(1).split("?");
  const hash = new URLSearchParams(rest);
  const models = await source.models();
  const model = models.find((each) => each.name === name) ?? models[0];
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
    view: (hash.get("~view") ?? "one") as View,
    across,
    along,
    crowd: 300,
    pixels: 4,
  });
  const page: Page = {
    store,
    source,
    card,
    scene: new Scene(document.querySelector("#stage")!),
    notice: console.error,
    signal: new AbortController().signal,
  };
  const [stage, side] = ["#stage", "#side"].map(
    (where) => document.querySelector<HTMLElement>(where)!,
  );
  mountLevels(stage!, page);
  mountCrowd(stage!, page);
  mountMap(side!, page);
  mountFiles(side!, page);
  page.scene.add((seconds) => {
    const { time, playing, speed } = store.state;
    if (playing) store.set({ time: (time + seconds * speed) % card.durations[0]! });
    return playing;
  });
  page.scene.redraw();
}

void start();
