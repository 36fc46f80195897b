/** Answers kept by a client, where no browser does it: bounded, the longest unused goes first. */

/** An answer with all of its body. */
export interface Whole {
  readonly headers: Headers;
  readonly content: Uint8Array<ArrayBuffer>;
}

export class Memory {
  readonly #limit: number;
  // A Map remembers the order in which its keys were set.
  readonly #kept = new Map<string, Whole>();
  #bytes = 0;

  /** limit: bytes of all bodies; 0 keeps nothing. */
  constructor(limit: number) {
    this.#limit = limit;
  }

  /** The answer to a link, of which the caller may do with the content whatever they like. */
  find(link: string): Whole | null {
    const found = this.#kept.get(link);
    if (!found) return null;
    this.#kept.delete(link);
    this.#kept.set(link, found);
    return copied(found);
  }

  /** Keeps an answer that has an entity tag, if it may be kept. */
  keep(link: string, answer: Whole): void {
    if (says(answer, "no-store") || !answer.headers.has("ETag")) return;
    if (answer.content.length > this.#limit) return;
    this.#drop(link);
    this.#kept.set(link, copied(answer));
    this.#bytes += answer.content.length;
    for (const oldest of this.#kept.keys()) {
      if (this.#bytes <= this.#limit) return;
      this.#drop(oldest);
    }
  }

  #drop(link: string): void {
    this.#bytes -= this.#kept.get(link)?.content.length ?? 0;
    this.#kept.delete(link);
  }
}

/** Whether an answer may be used for ever without asking: what the service says of name@hash. */
export function immutable(answer: Whole): boolean {
  return says(answer, "immutable");
}

function says(answer: Whole, directive: string): boolean {
  return answer.headers.get("Cache-Control")?.includes(directive) ?? false;
}

function copied({ headers, content }: Whole): Whole {
  return { headers, content: content.slice() };
}
