/** The service that this page came from, with the key that it may ask for. */

import { Client, type ClientOptions, CONTRACT } from "@posefield/client";

import type { Source } from "./page.ts";
import { post } from "./post.ts";

/** The page asks again by itself (watch.ts), and asks so that nothing fills caches on the way. */
const ASKING: ClientOptions = { retries: 0, timeout: 8000, longestLink: 0 };
const KEPT = "posefield-key";

/** A source whose key may change while others hold it. */
export class Service implements Source {
  #client = new Client("", kept());
  #key = stored();

  /** For this tab alone, and gone with it. */
  use(key: string): void {
    // First, for it refuses a key that none can be: kept, that would refuse the whole page.
    this.#client = new Client("", { ...ASKING, key });
    this.#key = key;
    keep(key);
  }

  readonly models: Source["models"] = (...words) => this.#client.models(...words);
  readonly card: Source["card"] = (...words) => this.#client.card(...words);
  readonly character: Source["character"] = (...words) => this.#client.character(...words);
  readonly pose: Source["pose"] = (...words) => this.#client.pose(...words);
  readonly clip: Source["clip"] = (...words) => this.#client.clip(...words);
  readonly crowd: Source["crowd"] = (...words) => this.#client.crowd(...words);
  readonly sigma: Source["sigma"] = (...words) => this.#client.sigma(...words);
  readonly kernel: Client["kernel"] = (...words) => this.#client.kernel(...words);
  readonly file: Client["file"] = (...words) => this.#client.file(...words);
  readonly why: Source["why"] = (...words) => this.#client.why(...words);

  /** The answer to a question as JSON; a Problem where it is refused. */
  readonly post = (path: string, body: string, signal: AbortSignal): Promise<Response> =>
    post(path, body, this.#key, signal);
}

/** Whether it may be asked again. */
export async function ready(): Promise<boolean> {
  try {
    return (await fetch("/readyz", { signal: AbortSignal.timeout(4000) })).ok;
  } catch {
    return false;
  }
}

/** In words, where the service's contract is not this page's; null where it is, or nobody answers. */
export async function mismatch(): Promise<string | null> {
  try {
    const answer = await fetch("/livez", { signal: AbortSignal.timeout(4000) });
    return answer.ok ? differs((await answer.json()) as { contract?: string }) : null;
  } catch {
    return null;
  }
}

export function differs({ contract }: { readonly contract?: string }): string | null {
  const page = `this page speaks ${CONTRACT}`;
  if (!contract)
    return `The service is older: it does not say which contract it speaks, and ${page}. Some things may be missing.`;
  if (contract.split(".")[0] === CONTRACT.split(".")[0]) return null;
  return `The service is of another version: it speaks contract ${contract}, and ${page}. Reload the page; if that does not help, what it shows may be wrong.`;
}

/** Whether it can be sent in a header, as all keys can that a service gives out. */
export function usable(key: string): boolean {
  return /^[\x21-\x7e]+$/.test(key);
}

function keep(key: string): void {
  try {
    sessionStorage.setItem(KEPT, key);
  } catch {
    // Where nothing may be kept, it holds until the page is closed.
  }
}

function kept(): ClientOptions {
  const key = stored();
  return key && usable(key) ? { ...ASKING, key } : ASKING;
}

function stored(): string | null {
  try {
    return sessionStorage.getItem(KEPT);
  } catch {
    return null;
  }
}
