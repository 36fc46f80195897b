/** What can go wrong, as a closed tree: PosefieldError > Problem | Unreachable | Unexpected. */

export class PosefieldError extends Error {
  override readonly name: string = "PosefieldError";
}

/** The service refuses, and says why (RFC 9457). */
export class Problem extends PosefieldError {
  override readonly name = "Problem";
  readonly status: number;
  /** The last part of `type`, as on the service's page of problems. */
  readonly kind: string;
  readonly detail: string;

  constructor(status: number, kind: string, title: string, detail: string) {
    super(detail ? `${title}: ${detail}` : title);
    this.status = status;
    this.kind = kind;
    this.detail = detail;
  }
}

/** No answer came, or none that was whole. */
export class Unreachable extends PosefieldError {
  override readonly name = "Unreachable";
}

/** An answer that this contract does not know. */
export class Unexpected extends PosefieldError {
  override readonly name = "Unexpected";
}
