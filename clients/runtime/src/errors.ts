/**
 * What can go wrong, with the names of the service's errors:
 *
 *     RuntimeFault
 *     ├── ModelError       a file that is no model of this version, or does not run
 *     └── InvalidField     a field of a question that is missing, unknown or out of range
 */

export class RuntimeFault extends Error {
  override readonly name: string = "RuntimeFault";
}

export class ModelError extends RuntimeFault {
  override readonly name = "ModelError";
}

export class InvalidField extends RuntimeFault {
  override readonly name = "InvalidField";
  /** Field of the question, such as "controls/speed". */
  readonly field: string;
  /** The value that was found, and the expected ones. */
  readonly detail: string;

  constructor(field: string, detail: string) {
    super(`${field}: ${detail}`);
    this.field = field;
    this.detail = detail;
  }
}
