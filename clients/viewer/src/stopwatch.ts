/** How long it takes until what was asked for is on screen, as measures that anybody may read.
 *
 * `posefield:first-pose` from the opening of the page; `posefield:drag` from each change of a
 * control to the drawing of a pose that answers it or a newer one.
 */

let first = true;
/** Measures of dragging: the oldest go, all at once. */
const KEPT = 1000;
let kept = 0;

export class Stopwatch {
  readonly #open: { readonly asked: number; readonly since: number }[] = [];
  #answered = 0;

  asked(asked: number): void {
    this.#open.push({ asked, since: performance.now() });
  }

  answered(asked: number): void {
    this.#answered = asked;
  }

  /** Called while what was answered is about to be drawn: it is when this turn ends. */
  drawn(): void {
    if (this.#answered && this.#open.length) queueMicrotask(() => this.#close());
  }

  #close(): void {
    const end = performance.now();
    while (this.#open.length && this.#open[0]!.asked <= this.#answered) {
      const { since } = this.#open.shift()!;
      if (first) performance.measure("posefield:first-pose", { start: 0, end });
      else dragged(since, end);
      first = false;
    }
  }
}

function dragged(start: number, end: number): void {
  if (++kept > KEPT) {
    performance.clearMeasures("posefield:drag");
    kept = 1;
  }
  performance.measure("posefield:drag", { start, end });
}
