/**
 * What can go wrong, as a closed tree:
 *
 *     PosefieldError
 *     ├── WrongQuestion      nothing was sent: a number, key or address that cannot be
 *     ├── Problem            the service refuses, and says why
 *     ├── Unreachable        no answer came
 *     │   ├── TimedOut       nothing came for too long
 *     │   └── Broken         an answer that ended in the middle
 *     └── Unexpected         an answer that this contract does not know
 *
 * Who ends a question by an AbortSignal is given the signal's own reason.
 */

import { CONTRACT, type components, PROBLEM_TYPES } from "./schema.ts";

type Document = components["schemas"]["Problem"];

/** Kinds of problems, as on the service's page of problems; "other" is one of a newer service. */
export type ProblemKind = KindOf<Document["type"]> | "other";

const PREFIX = "urn:posefield:problem:";
type KindOf<Type extends string> = Type extends `${typeof PREFIX}${infer Kind}` ? Kind : never;

/** Place of a fault in a question: a JSON pointer into it, or the name of a parameter. */
export interface Place {
  readonly pointer?: string;
  readonly parameter?: string;
  readonly detail: string;
}

export class PosefieldError extends Error {
  override readonly name: string = "PosefieldError";
}

/** Nothing was sent: what is asked for cannot be. */
export class WrongQuestion extends PosefieldError {
  override readonly name = "WrongQuestion";
}

/** The service refuses, and says why (RFC 9457). */
export class Problem extends PosefieldError {
  override readonly name = "Problem";
  readonly status: number;
  readonly kind: ProblemKind;
  /** Kind by which programs tell problems apart, in every version of the contract. */
  readonly type: string;
  readonly title: string;
  /** The value that was found, and the expected ones. */
  readonly detail: string;
  readonly places: readonly Place[];
  /** By which the service's log knows the request. */
  readonly requestId: string;
  /** Seconds after which the service wants to be asked again. */
  readonly retryAfter: number | null;

  constructor(document: Omit<Document, "type"> & { type: string }, retryAfter: number | null) {
    super(document.detail ? `${document.title}: ${document.detail}` : document.title);
    this.status = document.status;
    this.kind = kindOf(document.type);
    this.type = document.type;
    this.title = document.title;
    this.detail = document.detail;
    this.places = document.errors;
    this.requestId = document.instance;
    this.retryAfter = retryAfter;
  }
}

/** No answer came, or none that was whole. */
export class Unreachable extends PosefieldError {
  override readonly name: string = "Unreachable";
  /** Seconds after which those who stand before the service want to be asked again. */
  readonly retryAfter: number | null;

  constructor(
    message: string,
    options: ErrorOptions & { readonly retryAfter?: number | null } = {},
  ) {
    super(message, options);
    this.retryAfter = options.retryAfter ?? null;
  }
}

/** Nothing came for so long that this client has stopped waiting. */
export class TimedOut extends Unreachable {
  override readonly name = "TimedOut";
}

/** The answer ended before it was whole. */
export class Broken extends Unreachable {
  override readonly name = "Broken";
}

/** An answer that this contract does not know. */
export class Unexpected extends PosefieldError {
  override readonly name = "Unexpected";
  /** Version of the contract that the service speaks, if it could be asked. */
  readonly service: string | null;
  /** Version of the contract that this client is made from. */
  readonly client = CONTRACT;

  constructor(message: string, options: ErrorOptions & { readonly service?: string | null } = {}) {
    super(message + versions(options.service), options);
    this.service = options.service ?? null;
  }
}

function versions(service: string | null | undefined): string {
  if (!service || service === CONTRACT) return "";
  return `; the service speaks version ${service} of the contract, this client ${CONTRACT}`;
}

function kindOf(type: string): ProblemKind {
  const known: readonly string[] = PROBLEM_TYPES;
  return known.includes(type) ? (type.slice(PREFIX.length) as ProblemKind) : "other";
}
