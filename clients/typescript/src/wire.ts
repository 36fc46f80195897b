/** Requests over HTTP: the whole answer, or the error that says why there is none. */

import { read } from "./documents.ts";
import {
  Broken,
  type PosefieldError,
  Problem,
  TimedOut,
  Unexpected,
  Unreachable,
} from "./errors.ts";
import type { Request } from "./questions.ts";
import type { TransferOptions } from "./types.ts";

export interface WireOptions {
  /** Scheme, host and port; empty for the page's own. */
  readonly base: string;
  readonly headers: Readonly<Record<string, string>>;
  /** Milliseconds without a byte after which a request fails. */
  readonly timeout: number;
  /** Number of attempts after the first. */
  readonly retries: number;
  /** Milliseconds before the second attempt; doubled for each one after it. */
  readonly pause: number;
  readonly fetch: typeof fetch;
}

/** Answer with its whole body. */
export interface Whole {
  readonly headers: Headers;
  readonly content: Uint8Array<ArrayBuffer>;
}

/** Longest wait before another attempt, ms. */
const LONGEST_WAIT = 30_000;
/** Longest wait of a timer, ms; more is no limit. */
const LONGEST_TIMER = 2 ** 31 - 1;
const OVERLOADED = new Set([429, 503]);
/** Statuses of proxies that do not reach the service. */
const GATEWAYS = new Set([429, 502, 503, 504]);

export class Wire {
  readonly #options: WireOptions;

  constructor(options: WireOptions) {
    this.#options = options;
  }

  /** Result of `look` on the answer; repeated while the fault may pass. */
  async whole<Found>(
    request: Request,
    look: (answer: Whole) => Found,
    options: TransferOptions,
  ): Promise<Found> {
    const { retries, pause } = this.#options;
    for (let again = 0; ; again++) {
      try {
        return look(await this.once(request, options));
      } catch (fault) {
        const wait = again < retries ? waitAfter(fault, pause * 2 ** again) : null;
        if (wait === null) throw fault;
        await sleep(wait, options.signal);
      }
    }
  }

  /** Answer of one attempt. */
  async once(request: Request, { signal, onProgress }: TransferOptions): Promise<Whole> {
    const { base, fetch, timeout } = this.#options;
    const ended = new AbortController();
    const either = signal ? AbortSignal.any([signal, ended.signal]) : ended.signal;
    let received = 0;

    async function step<Got>(run: () => Promise<Got>, failed: string): Promise<Got> {
      const expire = () => ended.abort();
      const timer = timeout > LONGEST_TIMER ? undefined : setTimeout(expire, timeout);
      try {
        signal?.throwIfAborted();
        return await run();
      } catch (cause) {
        signal?.throwIfAborted();
        if (ended.signal.aborted)
          throw new TimedOut(`nothing came after ${received} bytes`, { cause });
        if (received === 0 && failed) throw new Unreachable(failed, { cause });
        throw new Broken(`the answer ended after ${received} bytes`, { cause });
      } finally {
        clearTimeout(timer);
      }
    }

    const init = { ...this.#init(request), signal: either };
    const silent = `${base || "the service"} does not answer`;
    const answer = await step(() => fetch(base + request.path, init), silent);
    try {
      expectKind(request, answer);
      const total = totalOf(answer);
      const reader = answer.body?.getReader();
      const pieces: Uint8Array[] = [];
      for (;;) {
        const piece = reader && (await step(() => reader.read(), "")).value;
        if (!piece) break;
        pieces.push(piece);
        received += piece.length;
        if (answer.ok) onProgress?.({ received, total });
      }
      const whole = { headers: answer.headers, content: joined(pieces, received) };
      if (!answer.ok) throw refusal(answer.status, whole);
      return whole;
    } catch (fault) {
      ended.abort();
      throw fault;
    }
  }

  #init({ method, body, mediaType }: Request): RequestInit {
    // Node takes compressed content that is cut for whole, so files are requested uncompressed.
    // Browsers tell the two apart, and ignore this header.
    const coding = mediaType === undefined ? {} : { "Accept-Encoding": "identity" };
    const headers = { ...this.#options.headers, ...coding };
    // A redirect would send the key to another server.
    const init = { method, headers, redirect: "manual" as const };
    if (body === null) return init;
    return { ...init, body, headers: { ...headers, "Content-Type": "application/json" } };
  }
}

/** Milliseconds to wait after a fault; null if it does not pass, or not soon. */
function waitAfter(fault: unknown, pause: number): number | null {
  if (!(fault instanceof Problem || fault instanceof Unreachable)) return null;
  if (fault instanceof Problem ? !OVERLOADED.has(fault.status) : fault instanceof TimedOut)
    return null;
  const told = 1000 * (fault.retryAfter ?? 0);
  if (told > LONGEST_WAIT) return null;
  // Half of it is random, so that clients that were refused together do not return together.
  return told + Math.min(pause, LONGEST_WAIT) * (0.5 + 0.5 * Math.random());
}

/** Wait, at most until the signal ends, which the next attempt reports. */
function sleep(milliseconds: number, signal: AbortSignal | undefined): Promise<void> {
  return new Promise((resolve) => {
    const timer = setTimeout(done, milliseconds);
    signal?.addEventListener("abort", done);
    if (signal?.aborted) done();
    function done(): void {
      clearTimeout(timer);
      signal?.removeEventListener("abort", done);
      resolve();
    }
  });
}

/** Throw Unexpected for a redirect, or a file of another media type. */
function expectKind({ mediaType }: Request, { ok, status, headers, type }: Response): void {
  if (type === "opaqueredirect" || (status >= 300 && status < 400)) {
    const to = headers.get("Location");
    throw new Unexpected(`the answer is elsewhere${to === null ? "" : `: ${to}`}`);
  }
  const kind = (headers.get("Content-Type") ?? "nothing").split(";")[0]!.trim().toLowerCase();
  if (!ok || mediaType === undefined || kind === mediaType) return;
  throw new Unexpected(`the file's media type: found ${kind}, expected ${mediaType}`);
}

function joined(pieces: readonly Uint8Array[], length: number): Uint8Array<ArrayBuffer> {
  const whole = new Uint8Array(length);
  let at = 0;
  for (const piece of pieces) {
    whole.set(piece, at);
    at += piece.length;
  }
  return whole;
}

/** Length of the body; null if unknown, as that of a compressed one. */
function totalOf({ headers }: Response): number | null {
  const length = headers.get("Content-Length");
  return length === null || headers.has("Content-Encoding") ? null : Number(length);
}

function refusal(status: number, { headers, content }: Whole): PosefieldError {
  const retryAfter = secondsOf(headers.get("Retry-After"));
  const problem = problemOf(headers, content, retryAfter);
  if (problem?.kind === "no-such-path") {
    const message = `the service lacks a path of the contract: ${problem.detail}`;
    return new Unexpected(message, { cause: problem });
  }
  if (problem) return problem;
  const message = `status ${status} without a problem document`;
  return GATEWAYS.has(status) ? new Unreachable(message, { retryAfter }) : new Unexpected(message);
}

/** Problem document of the service; null for any other content. */
function problemOf(headers: Headers, content: Uint8Array, after: number | null): Problem | null {
  if (!headers.get("Content-Type")?.startsWith("application/problem+json")) return null;
  try {
    return new Problem(read("Problem", content), after);
  } catch {
    return null;
  }
}

/** Seconds of a Retry-After header, which may be a date (RFC 9110 10.2.3). */
function secondsOf(retryAfter: string | null): number | null {
  if (retryAfter === null) return null;
  const seconds = Number(retryAfter);
  const found = Number.isNaN(seconds) ? (Date.parse(retryAfter) - Date.now()) / 1000 : seconds;
  return Number.isNaN(found) ? null : Math.max(0, found);
}
