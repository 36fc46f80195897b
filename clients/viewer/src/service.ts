/** The service that this page came from: its clients, its key, and checks that it answers. */

import { Client, type ClientOptions, CONTRACT } from "@posefield/client";

import { recall, remember } from "./dom.ts";

/** `Watch` repeats requests; links stay short, so that no cache on the way fills up. */
const OPTIONS: ClientOptions = { retries: 0, timeout: 8000, longestLink: 0 };
/** Timeout of performances, ms: up to ten minutes of motion. */
const PERFORMANCE_TIMEOUT = 60_000;
const KEY = "posefield-key";

export class Service {
  client!: Client;
  /** Client with a longer timeout. */
  performances!: Client;

  constructor() {
    const key = recall("sessionStorage", KEY);
    this.#connect(key && usable(key) ? { key } : {});
  }

  /** Send that key from now on; it is kept for this tab. */
  use(key: string): void {
    this.#connect({ key });
    remember("sessionStorage", KEY, key);
  }

  #connect(key: ClientOptions): void {
    this.client = new Client("", { ...OPTIONS, ...key });
    this.performances = new Client("", { ...OPTIONS, timeout: PERFORMANCE_TIMEOUT, ...key });
  }
}

/** Tell whether a header can carry the key, as those of all keys that a service gives out. */
export function usable(key: string): boolean {
  return /^[\x21-\x7e]+$/.test(key);
}

async function ready(): Promise<boolean> {
  try {
    return (await fetch("/readyz", { signal: AbortSignal.timeout(4000) })).ok;
  } catch {
    return false;
  }
}

/** Return a sentence where the service speaks another contract than this page; null otherwise. */
export async function mismatch(): Promise<string | null> {
  try {
    // Without a limit: nothing waits for this, and a busy machine may take its time.
    const answer = await fetch("/livez");
    return answer.ok ? differs((await answer.json()) as { contract?: string }) : null;
  } catch {
    return null;
  }
}

export function differs({ contract }: { readonly contract?: string }): string | null {
  if (contract?.split(".")[0] === CONTRACT.split(".")[0]) return null;
  return `The service is of another version: it speaks contract ${contract ?? "unsaid"}, and this page speaks ${CONTRACT}. Reload the page; if that does not help, what it shows may be wrong.`;
}

/** Milliseconds between two checks while all is well; first and longest wait while it is not. */
const [CALM, FIRST, LONGEST] = [5000, 400, 8000];
const GROWTH = 1.7;

/** Repeated check of the service, more often while it does not answer. */
export class Watch {
  readonly #check: () => Promise<void>;
  readonly #back: () => Promise<void>;
  #down = false;
  #ended = false;
  #wait = FIRST;
  #timer: ReturnType<typeof setTimeout> | undefined;

  /** check: called while all is well. back: called when the service is ready again. */
  constructor(check: () => Promise<void>, back: () => Promise<void>) {
    this.#check = check;
    this.#back = back;
    this.#next();
  }

  get down(): boolean {
    return this.#down;
  }

  /** Report a request that failed. */
  failed(): void {
    if (this.#down) return;
    this.#down = true;
    this.#next();
  }

  /** Report a request that succeeded: the next failure is checked at once. */
  well(): void {
    if (!this.#down) this.#wait = FIRST;
  }

  end(): void {
    this.#ended = true;
    clearTimeout(this.#timer);
  }

  #next(): void {
    clearTimeout(this.#timer);
    if (this.#ended) return;
    this.#timer = setTimeout(() => void this.#turn(), this.#down ? this.#wait : CALM);
  }

  async #turn(): Promise<void> {
    try {
      if (this.#down) await this.#retry();
      else if (!document.hidden) await this.#check();
    } catch (fault) {
      // Shown as an uncaught error, but the checks go on.
      reportError(fault);
    }
    this.#next();
  }

  async #retry(): Promise<void> {
    // A service may be ready and fail all the same, so the wait grows in any case.
    this.#wait = Math.min(LONGEST, GROWTH * this.#wait);
    if (!(await ready())) return;
    this.#down = false;
    await this.#back();
  }
}
