/** Requests for the newest of many questions: one at a time, older ones are dropped. */
export class Latest<Question> {
  readonly #answer: (question: Question) => Promise<void>;
  #waiting: { readonly question: Question } | null = null;
  #busy = false;

  constructor(answer: (question: Question) => Promise<void>) {
    this.#answer = answer;
  }

  ask(question: Question): void {
    this.#waiting = { question };
    if (!this.#busy) void this.#run();
  }

  async #run(): Promise<void> {
    this.#busy = true;
    try {
      while (this.#waiting) {
        const { question } = this.#waiting;
        this.#waiting = null;
        await this.#answer(question);
      }
    } finally {
      this.#busy = false;
    }
  }
}
