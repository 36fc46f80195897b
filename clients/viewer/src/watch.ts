/** Looks at the service from time to time, and more often while it does not answer. */

import { ready } from "./service.ts";

/** Milliseconds between two looks while all is well, and the first and longest wait while not. */
const CALM = 5000;
const FIRST = 400;
const LONGEST = 8000;

export class Watch {
  readonly #look: () => Promise<void>;
  readonly #back: () => Promise<void>;
  #wait = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;

  /** look: whenever all is well. back: when the service is ready again; throws while it is not. */
  constructor(look: () => Promise<void>, back: () => Promise<void>) {
    this.#look = look;
    this.#back = back;
    this.#next();
  }

  get down(): boolean {
    return this.#wait > 0;
  }

  /** Something was not answered. */
  failed(): void {
    if (this.down) return;
    this.#wait = FIRST;
    this.#next();
  }

  #next(): void {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => void this.#turn(), this.#wait || CALM);
  }

  async #turn(): Promise<void> {
    if (this.down) await this.#again();
    else if (!document.hidden) await this.#look();
    this.#next();
  }

  async #again(): Promise<void> {
    const wait = this.#wait;
    this.#wait = Math.min(LONGEST, 1.7 * wait);
    if (!(await ready())) return;
    this.#wait = 0;
    await this.#back();
  }
}
