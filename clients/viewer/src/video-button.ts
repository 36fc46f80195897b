/** A button that records the clip that is shown, from its beginning. */

import { el } from "./dom.ts";
import { saveFile } from "./save-file.ts";
import type { Session } from "./session.ts";
import * as video from "./video.ts";

/** say: shows what happens. */
export function videoButton(session: Session, say: (text: string) => void): HTMLButtonElement {
  const format = video.recordable();
  const made = el("button", { type: "button", class: "files-video" }, "Record video");
  made.hidden = format === null;
  let recording: AbortController | null = null;
  made.addEventListener("click", async () => {
    if (recording) return recording.abort();
    recording = new AbortController();
    made.textContent = "Stop";
    try {
      if (format) say(await recorded(session, format, recording.signal, say));
    } catch (fault) {
      say(`No video was recorded: ${fault}`);
    } finally {
      recording = null;
      made.textContent = "Record video";
    }
  });
  return made;
}

/** Play the clip from its beginning and save what the stage shows meanwhile. */
async function recorded(
  session: Session,
  format: video.Format,
  stopped: AbortSignal,
  say: (text: string) => void,
): Promise<string> {
  const { card, player, scene, signal, store } = session;
  const { model, loop, playing, speed, time, view } = store.state;
  const loops = view === "crowd" || (card.cyclic && loop);
  const seconds = video.length(player.duration / speed, loops);
  store.set({ playing: true, time: 0 });
  say(`Recording ${seconds.toFixed(1)} s …`);
  const content = await video.record(scene, format, seconds, AbortSignal.any([signal, stopped]));
  if (!signal.aborted) store.set({ playing, time });
  if (stopped.aborted || signal.aborted) return "Stopped; no video was saved.";
  const name = `${model.replace(/[^A-Za-z0-9_-]/g, "_")}.${format.ending}`;
  saveFile(name, content);
  return `${name} saved: ${seconds.toFixed(1)} s, ${Math.round(content.size / 1000)} kB.`;
}
