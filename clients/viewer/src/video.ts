/** The clip that plays, recorded from the stage as a video. */

import type { Scene } from "./scene.ts";

/** Seconds of a video at least: a shorter clip is repeated where it loops. */
export const SHORTEST = 3;
const RATE = 30;
const BITS = 4_000_000;

export interface Format {
  readonly mediaType: string;
  readonly ending: string;
}

/** In the order of preference; Safari records MP4 only. */
const FORMATS: readonly Format[] = [
  { mediaType: "video/webm;codecs=vp9", ending: "webm" },
  { mediaType: "video/webm;codecs=vp8", ending: "webm" },
  { mediaType: "video/mp4", ending: "mp4" },
];

/** The format that this browser records; null where it records none. */
export function recordable(): Format | null {
  if (typeof MediaRecorder === "undefined") return null;
  return FORMATS.find(({ mediaType }) => MediaRecorder.isTypeSupported(mediaType)) ?? null;
}

/** Seconds to record of a clip: whole laps, at least as long as SHORTEST where it loops. */
export function length(duration: number, loops: boolean): number {
  return loops ? duration * Math.max(1, Math.ceil(SHORTEST / duration)) : duration;
}

/**
 * Record the stage for some seconds.
 *
 * Raises the recorder's error. An aborted signal ends the recording with what there is.
 */
export function record(
  scene: Scene,
  format: Format,
  seconds: number,
  signal: AbortSignal,
): Promise<Blob> {
  const film = filmed(scene);
  const stream = film.canvas.captureStream(RATE);
  const recorder = new MediaRecorder(stream, {
    mimeType: format.mediaType,
    videoBitsPerSecond: BITS,
  });
  const parts: Blob[] = [];
  recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
  return new Promise((done, failed) => {
    const stop = () => recorder.state === "recording" && recorder.stop();
    const timer = setTimeout(stop, 1000 * seconds);
    signal.addEventListener("abort", stop);
    recorder.addEventListener("error", failed);
    recorder.addEventListener("stop", () => {
      clearTimeout(timer);
      film.end();
      for (const track of stream.getTracks()) track.stop();
      done(new Blob(parts, { type: format.mediaType }));
    });
    recorder.start();
  });
}

/** A canvas with all that is to be seen, drawn until the end. */
function filmed(scene: Scene): { canvas: HTMLCanvasElement; end: () => void } {
  const [stage, cover] = scene.canvases;
  if (!cover) return { canvas: stage!, end: () => {} };
  const { width, height } = stage!;
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const pen = canvas.getContext("2d")!;
  const end = scene.watch(() => {
    for (const each of scene.canvases) pen.drawImage(each, 0, 0, width, height);
  });
  return { canvas, end };
}
