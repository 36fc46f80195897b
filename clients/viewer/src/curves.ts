/** The model's curves, such as weights of blend shapes, as bars for the time that is shown. */

import type { Motion } from "@posefield/client";

import { el } from "./dom.ts";
import { step } from "./playback.ts";
import type { Session } from "./session.ts";

/** The curves at `time` between the two frames around it; null for a clip without curves. */
export function curvesAt(clip: Motion, time: number): Float32Array | null {
  const { curves, times } = clip;
  if (!curves) return null;
  const width = curves.length / times.length;
  const last = times.length - 1;
  const at = Math.min(last, Math.max(0, (time - times[0]!) / step(clip)));
  const first = Math.min(Math.floor(at), Math.max(0, last - 1));
  const second = Math.min(last, first + 1);
  return Float32Array.from({ length: width }, (_, i) => {
    const [before, after] = [curves[width * first + i]!, curves[width * second + i]!];
    return before + (at - first) * (after - before);
  });
}

/** A bar for each curve, from its smallest to its largest value; nothing without curves. */
export function mount(host: HTMLElement, { card, player }: Session): void {
  const own = card.curves ?? [];
  host.hidden = own.length === 0;
  if (!own.length) return;
  const bars = own.map(({ name, minimum, maximum }) => {
    const meter = el("meter", { min: minimum, max: maximum, "aria-label": name });
    const value = el("output", { "data-curve": name }, "…");
    return { meter, value, row: el("li", {}, el("span", { title: name }, name), meter, value) };
  });
  host.append(el("h2", {}, "Curves"), el("ul", { class: "curves" }, ...bars.map(({ row }) => row)));
  player.watch(({ curves }) => {
    bars.forEach(({ meter, value }, index) => {
      const found = curves?.[index];
      if (found === undefined) return;
      meter.value = found;
      value.textContent = found.toFixed(2);
    });
  });
}
