/** Options of a client and of its methods, and what they may be. */

import { WrongQuestion } from "./errors.ts";
import { checkNames, checkQuestion } from "./option-names.ts";
import type { ArchiveFormat, NamedClipQuestion, TransferOptions } from "./types.ts";

export interface ClientOptions {
  /** API key or token, sent as `Authorization: Bearer`. */
  readonly key?: string;
  /** Milliseconds without a byte after which a question ends with TimedOut; 30,000. */
  readonly timeout?: number;
  /** How often to ask again where a fault may pass; 3. */
  readonly retries?: number;
  /** Milliseconds before asking again for the first time, each time after that twice as many; 200. */
  readonly pause?: number;
  /** Bytes of answers to keep, for where no browser does it; 0. */
  readonly cacheBytes?: number;
  /** Characters up to which a question is a link (GET), beyond them a body (POST); 2,000. */
  readonly longestLink?: number;
  /** Asks in place of the platform's own. */
  readonly fetch?: typeof fetch;
}

export interface ArchiveOptions extends TransferOptions {
  /** What the clips are sent in; zip. */
  readonly as?: ArchiveFormat;
}

/** Names of ClientOptions, TransferOptions and ArchiveOptions, which have no values at run time. */
const CLIENT_NAMES = {
  key: true,
  timeout: true,
  retries: true,
  pause: true,
  cacheBytes: true,
  longestLink: true,
  fetch: true,
} as const satisfies Record<keyof ClientOptions, true>;
const TRANSFER_NAMES = { signal: true, onProgress: true } as const satisfies Record<
  keyof TransferOptions,
  true
>;
const ARCHIVE_NAMES = { ...TRANSFER_NAMES, as: true } as const satisfies Record<
  keyof ArchiveOptions,
  true
>;

export function checkClientOptions(options: ClientOptions): void {
  checkNames("ClientOptions", Object.keys(CLIENT_NAMES), options);
}

export function checkTransferOptions(options: TransferOptions): void {
  checkNames("TransferOptions", Object.keys(TRANSFER_NAMES), options);
}

export function checkArchive(clips: readonly NamedClipQuestion[], options: TransferOptions): void {
  for (const clip of clips) checkQuestion("NamedClipQuestion", clip);
  checkNames("ArchiveOptions", Object.keys(ARCHIVE_NAMES), options);
}

/** The address of a service; WrongQuestion where it is none. */
export function addressOf(base: string): string {
  if (base === "" || (/^https?:\/\/[^?#@\s]+$/i.test(base) && URL.canParse(base))) return base;
  throw new WrongQuestion("the address: expected http://host:port or https://host:port");
}

/** A key that a header can hold; the error does not say it. */
export function printable(key: string): string {
  if (/^[\x21-\x7e]+$/.test(key)) return key;
  throw new WrongQuestion("the key: expected printable ASCII without blanks");
}
