/** Looks at the service from time to time, and more often while it does not answer. */

import { ready } from "./service.ts";

/** Milliseconds between two looks while all is well, and the first and longest wait while not. */
const CALM = 5000;
const FIRST = 400;
const LONGEST = 8000;
const LONGER = 1.7;

export class Watch {
  readonly #look: () => Promise<void>;
  readonly #back: () => Promise<void>;
  #down = false;
  #ended = false;
  #wait = FIRST;
  #timer: ReturnType<typeof setTimeout> | undefined;

  /** look: whenever all is well. back: when the service is ready again; throws while it is not. */
  constructor(look: () => Promise<void>, back: () => Promise<void>) {
    this.#look = look;
    this.#back = back;
    this.#next();
  }

  get down(): boolean {
    return this.#down;
  }

  /** Something was not answered. */
  failed(): void {
    if (this.#down) return;
    this.#down = true;
    this.#next();
  }

  /** Something was answered: who fails next is looked after at once. */
  well(): void {
    if (!this.#down) this.#wait = FIRST;
  }

  /** Nobody looks any more. */
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
      if (this.#down) await this.#again();
      else if (!document.hidden) await this.#look();
    } catch (fault) {
      // As if nobody had caught it, but looking goes on.
      reportError(fault);
    }
    this.#next();
  }

  async #again(): Promise<void> {
    // It may be ready, and fail all the same.
    this.#wait = Math.min(LONGEST, LONGER * this.#wait);
    if (!(await ready())) return;
    this.#down = false;
    await this.#back();
  }
}
