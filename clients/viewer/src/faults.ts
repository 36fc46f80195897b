/** What went wrong, in words, and what the page does about it. */

import { PosefieldError, Problem, TimedOut, Unexpected, Unreachable } from "@posefield/client";

/** wait: ask /readyz until it is well. key: ask for one. model: it is gone, show another. */
export type Remedy = "wait" | "key" | "model" | "none";

export interface Fault {
  readonly text: string;
  readonly remedy: Remedy;
}

/** null where nobody needs to know: what was asked is not wanted any more. */
export function understood(fault: unknown): Fault | null {
  if (typeof fault === "string") return { text: fault, remedy: "none" };
  if (fault instanceof DOMException && fault.name === "AbortError") return null;
  if (fault instanceof DOMException && fault.name === "TimeoutError") return SLOW;
  if (fault instanceof TimedOut) return SLOW;
  if (fault instanceof Unreachable) return DOWN;
  if (fault instanceof Problem) return refused(fault);
  if (fault instanceof Unexpected) return { text: unexpected(fault), remedy: "wait" };
  // What a copy without a service cannot be asked.
  if (fault instanceof PosefieldError) return { text: fault.message, remedy: "none" };
  return { text: `Something in this page went wrong: ${fault}`, remedy: "none" };
}

const DOWN: Fault = {
  text: "The service does not answer. The last picture stays; trying again until it does.",
  remedy: "wait",
};

const SLOW: Fault = {
  text: "The service took too long to answer. The last picture stays; trying again.",
  remedy: "wait",
};

function refused(fault: Problem): Fault {
  if (fault.status === 401) return { text: "The service asks for a key.", remedy: "key" };
  if (fault.status === 403)
    return { text: `This key does not open that: ${fault.detail}`, remedy: "key" };
  if (fault.kind.endsWith("unknown-model")) return { text: fault.message, remedy: "model" };
  if (fault.status === 429 || fault.status >= 500)
    return {
      text: `The service is busy or restarting (${fault.message}). The last picture stays; trying again.`,
      remedy: "wait",
    };
  return { text: fault.message, remedy: "none" };
}

function unexpected(fault: Unexpected): string {
  return `The answer makes no sense here, maybe from another version or something in between: ${fault.message}. Trying again.`;
}
