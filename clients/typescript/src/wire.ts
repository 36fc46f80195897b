/** Requests over HTTP: what comes back whole, or the error that says what happened. */

import { read } from "./documents.ts";
import {
  Broken,
  type PosefieldError,
  Problem,
  TimedOut,
  Unexpected,
  Unreachable,
} from "./errors.ts";
import { immutable, Memory, type Whole } from "./memory.ts";
import { Patience } from "./patience.ts";
import type { Request } from "./questions.ts";
import { type Retries, retried } from "./retries.ts";
import type { OnProgress, TransferOptions } from "./types.ts";

export interface WireOptions extends Retries {
  /** Scheme, host and port; empty for where the page comes from. */
  readonly base: string;
  readonly headers: Lines;
  /** Milliseconds without a byte after which nobody waits on. */
  readonly timeout: number;
  /** Bytes of answers that are kept; see Memory. */
  readonly cacheBytes: number;
  readonly fetch: typeof fetch;
}

/** An answer whose head has come; the patience is for the rest of it. */
export interface Begun {
  readonly answer: Response;
  readonly patience: Patience;
}

type Lines = Readonly<Record<string, string>>;

type Look<Found> = (answer: Whole) => Found;

/**
 * Node takes compressed content that is cut for whole, so files are asked for as they are. Browsers
 * tell the two apart; they let no page set this header, and leave it out without a word.
 */
const PLAIN = { "Accept-Encoding": "identity" };

export class Wire {
  readonly #options: WireOptions;
  readonly #memory: Memory;

  constructor(options: WireOptions) {
    this.#options = options;
    this.#memory = new Memory(options.cacheBytes);
  }

  /** What `look` finds in the answer with all of its body, asked for again where a fault may pass. */
  whole<Found>(request: Request, look: Look<Found>, options: TransferOptions): Promise<Found> {
    return retried(() => this.#once(request, look, options), this.#options, options.signal);
  }

  /** The answer to a request, asked for once. */
  async once(request: Request, signal: AbortSignal | undefined): Promise<Whole> {
    return rest(await this.#begun(request, {}, signal));
  }

  /** The answer's head, asked for again where a fault may pass; its body is the caller's. */
  begin(request: Request, signal: AbortSignal | undefined): Promise<Begun> {
    return retried(() => this.#begun(request, {}, signal), this.#options, signal);
  }

  async #once<Found>(
    request: Request,
    look: Look<Found>,
    { signal, onProgress }: TransferOptions,
  ): Promise<Found> {
    const kept = request.method === "GET" ? this.#memory.find(request.path) : null;
    if (kept && immutable(kept)) return look(kept);
    const tag = kept?.headers.get("ETag");
    const begun = await this.#begun(request, tag ? { "If-None-Match": tag } : {}, signal);
    if (kept && begun.answer.status === 304) {
      begun.patience.end();
      return look(kept);
    }
    const answer = await rest(begun, onProgress);
    const found = look(answer);
    // Only now: what is no answer would be one for as long as it is kept.
    if (request.method === "GET") this.#memory.keep(request.path, answer);
    return found;
  }

  async #begun(request: Request, headers: Lines, signal?: AbortSignal): Promise<Begun> {
    const patience = new Patience(this.#options.timeout, signal);
    const answer = await this.#fetched(request, headers, patience);
    patience.rest();
    const unchanged = answer.status === 304 && "If-None-Match" in headers;
    if (!answer.ok && !unchanged) throw await refusal({ answer, patience });
    const mediaType = unchanged ? undefined : request.mediaType;
    const said = (answer.headers.get("Content-Type") ?? "nothing").split(";")[0]!.trim();
    if (mediaType === undefined || said.toLowerCase() === mediaType) return { answer, patience };
    patience.leave();
    throw new Unexpected(`the file's media type: found ${said}, expected ${mediaType}`);
  }

  async #fetched(request: Request, headers: Lines, patience: Patience): Promise<Response> {
    const { base, fetch } = this.#options;
    try {
      return await fetch(base + request.path, this.#init(request, headers, patience.signal));
    } catch (fault) {
      patience.end();
      patience.throwIfCancelled();
      const who = base || "the service";
      if (patience.over) throw new TimedOut(`${who} takes too long`, { cause: fault });
      throw new Unreachable(`${who} does not answer`, { cause: fault });
    }
  }

  #init({ method, body, mediaType }: Request, more: Lines, signal: AbortSignal): RequestInit {
    const coding = mediaType === undefined ? {} : PLAIN;
    const headers = { ...this.#options.headers, ...coding, ...more };
    // Elsewhere than where one asks, nobody is to be told the key.
    const init = { method, headers, signal, redirect: "manual" as const };
    if (body === null) return init;
    return { ...init, body, headers: { ...headers, "Content-Type": "application/json" } };
  }
}

/** Pieces of a body as they come; Broken or TimedOut where the last one does not. */
export async function* pieces(
  { answer, patience }: Begun,
  onProgress?: OnProgress,
): AsyncGenerator<Uint8Array<ArrayBuffer>, void> {
  const reader = answer.body?.getReader();
  const total = totalOf(answer);
  let received = 0;
  try {
    for (;;) {
      const piece = reader && (await next(reader, patience, received));
      if (!piece) return;
      received += piece.length;
      onProgress?.({ received, total });
      yield piece;
    }
  } finally {
    patience.end();
    // Who stops asking for pieces wants no more to come.
    await reader?.cancel().catch(() => {});
  }
}

async function next(
  reader: ReadableStreamDefaultReader<Uint8Array<ArrayBuffer>>,
  patience: Patience,
  received: number,
): Promise<Uint8Array<ArrayBuffer> | undefined> {
  patience.renew();
  try {
    return (await reader.read()).value;
  } catch (fault) {
    patience.throwIfCancelled();
    throw ending(fault, patience, received);
  } finally {
    // Until somebody asks for the next piece, which may be long after this one.
    patience.rest();
  }
}

/** The answer with the rest of it. */
async function rest(begun: Begun, onProgress?: OnProgress): Promise<Whole> {
  const found: Uint8Array[] = [];
  for await (const piece of pieces(begun, onProgress)) found.push(piece);
  return { headers: begun.answer.headers, content: joined(found) };
}

function joined(pieces: readonly Uint8Array[]): Uint8Array<ArrayBuffer> {
  const whole = new Uint8Array(pieces.reduce((sum, piece) => sum + piece.length, 0));
  let at = 0;
  for (const piece of pieces) {
    whole.set(piece, at);
    at += piece.length;
  }
  return whole;
}

/** What is sent compressed is longer when it has come than its head says. */
function totalOf(answer: Response): number | null {
  const length = answer.headers.get("Content-Length");
  return length === null || answer.headers.has("Content-Encoding") ? null : Number(length);
}

function ending(fault: unknown, patience: Patience, received: number): PosefieldError {
  if (patience.over) return new TimedOut(`nothing came after ${received} bytes`, { cause: fault });
  return new Broken(`the answer ended after ${received} bytes`, { cause: fault });
}

/** Statuses of those who stand before a service and do not reach it, or let it be reached. */
const OF_PROXIES = new Set([429, 502, 503, 504]);

async function refusal(begun: Begun): Promise<PosefieldError> {
  const { status, headers, type } = begun.answer;
  if (type === "opaqueredirect" || (status >= 300 && status < 400)) return redirection(begun);
  const { content } = await rest(begun);
  const retryAfter = secondsOf(headers.get("Retry-After"));
  const problem = problemOf(headers, content, retryAfter);
  // All paths that are asked for here are the contract's.
  if (problem) return problem.kind === "no-such-path" ? unknownPath(problem) : problem;
  const what = `status ${status} without a problem's description`;
  return OF_PROXIES.has(status) ? new Unreachable(what, { retryAfter }) : new Unexpected(what);
}

/** Browsers do not say where to. */
function redirection({ answer, patience }: Begun): Unexpected {
  patience.leave();
  const to = answer.headers.get("Location");
  return new Unexpected(`the answer is to be had elsewhere${to === null ? "" : `: ${to}`}`);
}

/** What the service says is wrong; null where it is not the service that speaks. */
function problemOf(headers: Headers, content: Uint8Array, after: number | null): Problem | null {
  if (!headers.get("Content-Type")?.startsWith("application/problem+json")) return null;
  try {
    return new Problem(read("Problem", content), after);
  } catch {
    return null;
  }
}

function unknownPath(problem: Problem): Unexpected {
  return new Unexpected(`the service lacks a path of the contract: ${problem.detail}`, {
    cause: problem,
  });
}

/** Seconds, or until when, as RFC 9110 10.2.3 has it. */
function secondsOf(retryAfter: string | null): number | null {
  if (retryAfter === null) return null;
  const seconds = Number(retryAfter);
  const found = Number.isNaN(seconds) ? (Date.parse(retryAfter) - Date.now()) / 1000 : seconds;
  return Number.isNaN(found) ? null : Math.max(0, found);
}
