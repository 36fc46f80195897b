/** How long an answer is waited for. */

/** What a timer can wait for, ms: more is for ever. */
const LONGEST = 2 ** 31 - 1;

/** A signal that ends with the caller's own, or when nothing has come for some milliseconds. */
export class Patience {
  /** Whether nothing came for too long. */
  over = false;
  readonly #milliseconds: number;
  readonly #caller: AbortSignal | undefined;
  readonly #ending = new AbortController();
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(milliseconds: number, caller: AbortSignal | undefined) {
    this.#milliseconds = milliseconds;
    this.#caller = caller;
    caller?.throwIfAborted();
    caller?.addEventListener("abort", this.#abort);
    this.renew();
  }

  get signal(): AbortSignal {
    return this.#ending.signal;
  }

  /** What comes next is waited for from now on. */
  renew(): void {
    clearTimeout(this.#timer);
    if (this.#milliseconds > LONGEST) return;
    this.#timer = setTimeout(this.#expire, this.#milliseconds);
  }

  /** Nothing is waited for: it is not the service who is slow. */
  rest(): void {
    clearTimeout(this.#timer);
  }

  /** All has come. */
  end(): void {
    this.rest();
    this.#caller?.removeEventListener("abort", this.#abort);
  }

  /** Nothing more is wanted: what still comes is ended, and the connection with it. */
  leave(): void {
    this.end();
    this.#ending.abort();
  }

  /** Throws the caller's reason, if it is the caller who has ended this. */
  throwIfCancelled(): void {
    this.#caller?.throwIfAborted();
  }

  readonly #abort = (): void => this.#ending.abort(this.#caller?.reason);

  readonly #expire = (): void => {
    this.over = true;
    this.#ending.abort();
  };
}
