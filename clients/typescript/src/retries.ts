/** Asking again: every question is pure, so that it may be asked as often as one likes. */

import { Problem, TimedOut, Unreachable } from "./errors.ts";

export interface Retries {
  /** How often to ask again after the first time. */
  readonly retries: number;
  /** Milliseconds before asking again for the first time, each time after that twice as many. */
  readonly pause: number;
}

/** Longer than this, ms, nobody waits by itself, nor because a service says so. */
const LONGEST = 30_000;
const FOR_NOW = new Set([429, 503]);

/** The first answer to something, asked again where the fault may pass. */
export async function retried<Answer>(
  ask: () => Promise<Answer>,
  plan: Retries,
  signal: AbortSignal | undefined,
): Promise<Answer> {
  for (let again = 0; ; again++) {
    try {
      return await ask();
    } catch (fault) {
      const wait = pause(fault, plan.pause * 2 ** again);
      if (again >= plan.retries || wait === null) throw fault;
      await sleep(wait, signal);
    }
  }
}

/** Milliseconds to wait after a fault; null where it does not pass, or not soon. */
function pause(fault: unknown, own: number): number | null {
  if (!passes(fault)) return null;
  const told = 1000 * (fault.retryAfter ?? 0);
  if (told > LONGEST) return null;
  // Half of it by chance, so that clients that were refused together do not come back together.
  return told + Math.min(own, LONGEST) * (0.5 + 0.5 * Math.random());
}

function passes(fault: unknown): fault is Problem | Unreachable {
  if (fault instanceof Problem) return FOR_NOW.has(fault.status);
  // Who has waited until the time was over does not want to wait as long again.
  return fault instanceof Unreachable && !(fault instanceof TimedOut);
}

/** Waits; not on when the signal ends, which the next attempt then says. */
function sleep(milliseconds: number, signal: AbortSignal | undefined): Promise<void> {
  return new Promise((resolve) => {
    const timer = setTimeout(done, milliseconds);
    signal?.addEventListener("abort", done);
    if (signal?.aborted) done();
    function done(): void {
      clearTimeout(timer);
      signal?.removeEventListener("abort", done);
      resolve();
    }
  });
}
