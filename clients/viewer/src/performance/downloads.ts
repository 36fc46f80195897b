/** The performance as a file, in all formats of clips. */

import { PosefieldError } from "@posefield/client";

import { chooser, el, labelled } from "../dom.ts";
import { saveFile } from "../save-file.ts";
import { figure } from "../written.ts";
import { file } from "./answers.ts";
import type { Desk } from "./desk.ts";

const FORMATS = [
  ["usdc", "USD, binary (.usdc)"],
  ["usda", "USD, text (.usda)"],
  ["usdz", "USD package (.usdz)"],
  ["glb", "glTF (.glb)"],
  ["bvh", "BVH (.bvh)"],
  ["npz", "NumPy (.npz)"],
  ["arrow", "Arrow (.arrow)"],
  ["msgpack", "MessagePack (.msgpack)"],
  ["json", "JSON (.json)"],
] as const;

export function mount(host: HTMLElement, desk: Desk): void {
  let format = "usdc";
  const said = el("p", { class: "about saved", role: "status" });
  const get = el("button", { type: "button", class: "act" });
  const show = () => {
    get.textContent = `Download performance.${format}`;
    get.disabled = desk.refused || !desk.script;
  };
  const formats = chooser(FORMATS, format, (value) => {
    format = value;
    show();
  });
  get.addEventListener(
    "click",
    () =>
      void download(desk, format, (text) => {
        said.textContent = text;
      }),
  );
  host.append(el("div", { class: "performance-file" }, labelled("Format", formats), get), said);
  desk.listen((change) => {
    if (change === "answer") show();
  });
  show();
}

async function download(desk: Desk, format: string, say: (text: string) => void): Promise<void> {
  const { signal, store } = desk.session;
  const name = `performance.${format}`;
  say(`Requesting ${name} …`);
  try {
    const content = await file(desk.stage, format, store.state.script, signal);
    saveFile(name, content);
    say(`${name} saved: ${figure(content.size / 1e3)} kB.`);
  } catch (fault) {
    if (signal.aborted) return;
    say(`Nothing was saved: ${fault instanceof PosefieldError ? fault.message : String(fault)}`);
  }
}
