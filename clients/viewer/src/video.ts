/** Videos of the stage, recorded by the browser, and the button that records the clip. */

import { saveFile, textButton } from "./dom.ts";
import type { Session } from "./player.ts";

/** Shortest video of a clip that loops, s. */
export const SHORTEST = 3;
const RATE = 30;
const BITS = 4_000_000;

interface Format {
  readonly mediaType: string;
  readonly ending: string;
}

/** In the order of preference; Safari records MP4 only. */
const FORMATS: readonly Format[] = [
  { mediaType: "video/webm;codecs=vp9", ending: "webm" },
  { mediaType: "video/webm;codecs=vp8", ending: "webm" },
  { mediaType: "video/mp4", ending: "mp4" },
];

/** A button that records the clip from its beginning. say: shows what happens. */
export function videoButton(session: Session, say: (text: string) => void): HTMLButtonElement {
  const format =
    typeof MediaRecorder === "undefined"
      ? undefined
      : FORMATS.find(({ mediaType }) => MediaRecorder.isTypeSupported(mediaType));
  let recording: AbortController | null = null;
  const name = "Record video";
  const element = textButton(
    name,
    async () => {
      if (recording) return recording.abort();
      recording = new AbortController();
      element.textContent = "Stop";
      try {
        if (format) say(await recordClip(session, format, recording.signal, say));
      } catch (fault) {
        say(`No video was recorded: ${fault}`);
      } finally {
        recording = null;
        element.textContent = name;
      }
    },
    "files-video",
  );
  element.hidden = !format;
  return element;
}

/** Play the clip from its beginning, save the video, and return a sentence about it. */
async function recordClip(
  { card, player, scene, signal, store }: Session,
  format: Format,
  stopped: AbortSignal,
  say: (text: string) => void,
): Promise<string> {
  const { model, loop, playing, speed, time, view } = store.state;
  const seconds = length(player.duration / speed, view === "crowd" || (card.cyclic && loop));
  store.set({ playing: true, time: 0 });
  say(`Recording ${seconds.toFixed(1)} s …`);
  const ended = AbortSignal.any([signal, stopped]);
  const content = await record(scene.renderer.domElement, format, seconds, ended);
  if (!signal.aborted) store.set({ playing, time });
  if (ended.aborted) return "Stopped; no video was saved.";
  const name = `${model.replace(/[^A-Za-z0-9_-]/g, "_")}.${format.ending}`;
  saveFile(name, content);
  return `${name} saved: ${seconds.toFixed(1)} s, ${Math.round(content.size / 1000)} kB.`;
}

/** Return the seconds to record: whole laps of a clip that loops, at least SHORTEST. */
export function length(duration: number, loops: boolean): number {
  return loops ? duration * Math.max(1, Math.ceil(SHORTEST / duration)) : duration;
}

function record(
  canvas: HTMLCanvasElement,
  { mediaType }: Format,
  seconds: number,
  ended: AbortSignal,
): Promise<Blob> {
  const stream = canvas.captureStream(RATE);
  const recorder = new MediaRecorder(stream, { mimeType: mediaType, videoBitsPerSecond: BITS });
  const parts: Blob[] = [];
  recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
  return new Promise((done, failed) => {
    const stop = () => recorder.state === "recording" && recorder.stop();
    const timer = setTimeout(stop, 1000 * seconds);
    ended.addEventListener("abort", stop);
    recorder.addEventListener("error", failed);
    recorder.addEventListener("stop", () => {
      clearTimeout(timer);
      for (const track of stream.getTracks()) track.stop();
      done(new Blob(parts, { type: mediaType }));
    });
    recorder.start();
  });
}
