/** A page that computes with its model: sliders, a clip, walkers that are steered, a download. */

import "../../viewer/src/colours.css";
import "./page.css";

import type { ModelCard } from "@posefield/client";
import { load } from "@posefield/runtime";
import * as characters from "../../viewer/src/character.ts";
import { saveFile } from "../../viewer/src/dom.ts";
import { Scene } from "../../viewer/src/scene.ts";
import * as theme from "../../viewer/src/theme.ts";
import { ClipView } from "./clip-view.ts";
import { Panel } from "./panel.ts";
import { WalkView } from "./walk-view.ts";

/** A model of the folder, and its skin. */
interface Entry {
  readonly name: string;
  readonly model: string;
  readonly character: string;
  /** Root of the skin at rest, m. */
  readonly root: readonly [number, number, number];
  /** Checksums of both files, as `fetch` verifies them. */
  readonly integrity?: Readonly<Record<"model" | "character", string>>;
}

/** The view that is shown, and the number of the newest model, which overtakes earlier ones. */
let view: View | null = null;
let turn = 0;

/** A way to show a model, until it is disposed. */
export interface View {
  readonly ready: Promise<void>;
  change?(): void;
  dispose(): void;
}

const ort = import("onnxruntime-web/wasm").then((build) => {
  build.env.wasm.numThreads = 1;
  // WebAssembly takes longest: a first session, which is refused, loads it beside the models.
  build.InferenceSession.create(new Uint8Array(0)).catch(() => {});
  return build;
});
const told = document.querySelector<HTMLElement>("#told")!;
addEventListener("error", ({ error, message }) => tell(error ?? message));
addEventListener("unhandledrejection", ({ reason }) => tell(reason));
theme.start();
const scene = new Scene(document.querySelector<HTMLElement>("#stage")!);
const form = document.querySelector<HTMLFormElement>("#panel")!;
form.addEventListener("submit", (event) => event.preventDefault());

function tell(fault: unknown): void {
  told.textContent = fault instanceof Error ? fault.message : String(fault);
}

/** Open the model that the address names, or the first. */
async function open(entries: readonly Entry[]): Promise<void> {
  const name = decodeURIComponent(location.hash.slice(1));
  const named = entries.find((one) => one.name === name);
  const entry = named ?? entries[0]!;
  turn += 1;
  const number = turn;
  const [build, content, skin] = await Promise.all([
    ort,
    bytes(entry.model, entry.integrity?.model),
    bytes(entry.character, entry.integrity?.character),
  ]);
  const model = await load(content, { ort: build });
  if (number !== turn) return;
  view?.dispose();
  const character = characters.read(skin);
  const { skeleton } = model.card;
  const standing = { ...skeleton, offsets: [entry.root, ...skeleton.offsets.slice(1)] };
  const card = { ...model.card, skeleton: standing } as unknown as ModelCard;
  const panel = new Panel(form, model, entries, entry, {
    change: () => view?.change?.(),
    show: () => show(),
    open: (chosen) => {
      location.hash = chosen;
    },
    download: async () => {
      const { glb } = await import("./download.ts");
      const clip = await model.clip(panel.state.controls, { ...panel.state.options, fps: 60 });
      const content = await glb(card, clip, character);
      saveFile(`${model.card.name}.glb`, new Blob([content], { type: "model/gltf-binary" }));
    },
  });
  const show = () => {
    view?.dispose();
    const walks = panel.state.view === "walk";
    const stage = { scene, model, card, character, panel };
    view = walks ? new WalkView(stage) : new ClipView(stage);
    view.ready.then(() => {
      told.textContent = walks
        ? "Arrow keys, W A D or the disc walk and turn, Shift slows; click the ground to walk there."
        : name && !named
          ? `This page has no model ${name}: this is ${entry.name}.`
          : model.card.description;
      // The frame after the first drawing.
      requestAnimationFrame(() => requestAnimationFrame(() => performance.mark("moving")));
    });
  };
  show();
}

async function bytes(url: string, integrity = ""): Promise<Uint8Array<ArrayBuffer>> {
  const answer = await fetch(url, { integrity }).catch(() => null);
  if (!answer) throw new Error(`${url} cannot be loaded, or is not the file that this page has.`);
  if (!answer.ok) throw new Error(`${url} cannot be loaded: status ${answer.status}.`);
  return new Uint8Array(await answer.arrayBuffer());
}

async function start(): Promise<void> {
  if (!("WebAssembly" in globalThis)) throw new Error("This browser runs no WebAssembly.");
  const list = new TextDecoder().decode(await bytes("models.json"));
  if (!list.startsWith("["))
    throw new Error("models.json is another file than posefield page wrote.");
  const entries = JSON.parse(list) as Entry[];
  addEventListener("hashchange", () => open(entries));
  await open(entries);
}

start();
