/** A layer of USD as the parsers of three.js give it: fields by path. */

import { Refusal } from "./motion.ts";

interface Samples {
  readonly times: readonly number[];
  readonly values: readonly unknown[];
}

export type Specs = Readonly<
  Record<string, { readonly fields: Readonly<Record<string, unknown>> }>
>;

const MOVING = ["translations", "rotations", "scales"];
const ELSEWHERE = [
  "references",
  "payload",
  "inheritPaths",
  "specializes",
  "variantSetNames",
  "variantSelection",
  "subLayers",
];
/** USD's default of time codes a second. */
const DEFAULT_PACE = 24;

export class Layer {
  readonly #specs: Specs;

  constructor(specs: Specs) {
    this.#specs = specs;
    if (!specs["/"] && !Object.keys(specs).length)
      throw new Refusal("does not open as USD: found no prims. The file is damaged or not whole");
  }

  /** Paths of the prims of a type, in the order of the layer. */
  prims(type: string): string[] {
    const found: string[] = [];
    const ahead = ["/"];
    const most = Object.keys(this.#specs).length;
    while (ahead.length) {
      const path = ahead.pop()!;
      const fields = this.#fields(path);
      if (fields["typeName"] === type) found.push(path);
      const children = (fields["primChildren"] ?? []) as readonly string[];
      if (found.length + ahead.length > most)
        throw new Refusal("does not open as USD: found prims within themselves");
      ahead.push(...children.map((name) => `${path === "/" ? "" : path}/${name}`).reverse());
    }
    return found;
  }

  /** A number that the layer states; null if it does not. */
  number(name: string): number | null {
    const found = this.#fields("/")[name];
    return typeof found === "number" && Number.isFinite(found) ? found : null;
  }

  get up(): "y" | "z" | null {
    const said = this.#fields("/")["upAxis"];
    return said === undefined ? null : String(said).toLowerCase() === "z" ? "z" : "y";
  }

  get statesPace(): boolean {
    return this.number("timeCodesPerSecond") !== null || this.number("framesPerSecond") !== null;
  }

  /** Time codes a second. */
  get pace(): number {
    const found =
      this.number("timeCodesPerSecond") ?? this.number("framesPerSecond") ?? DEFAULT_PACE;
    if (!(found > 0 && found < 1e6))
      throw new Refusal(`states ${found} time codes a second, expected a positive number`);
    return found;
  }

  /** Prims that are made of other files or of variants. */
  get references(): string[] {
    return Object.keys(this.#specs).filter((path) =>
      ELSEWHERE.some((name) => isSome(this.#fields(path)[name])),
    );
  }

  /** The prims from the skeleton upwards that move it. */
  transformsAbove(path: string): string[] {
    const found: string[] = [];
    for (let each = path; each; each = each.slice(0, each.lastIndexOf("/")))
      if (
        isSome(this.#fields(each)["xformOpOrder"]) ||
        this.numbersOrWords(`${each}.xformOpOrder`).length
      )
        found.push(each);
    return found;
  }

  /** Whether a mesh hangs on a skeleton: it has weights, or names one. */
  isBound(path: string): boolean {
    const own =
      this.#specs[`${path}.primvars:skel:jointIndices`] ?? this.#specs[`${path}.skel:skeleton`];
    return own !== undefined;
  }

  /** The path of the animation that a prim, or one above it, is bound to. */
  source(path: string): string | null {
    for (let each = path; each; each = each.slice(0, each.lastIndexOf("/"))) {
      const [found] = (this.#fields(`${each}.skel:animationSource`)["targetPaths"] ??
        []) as string[];
      if (found) return found;
    }
    return null;
  }

  words(path: string): string[] {
    return this.numbersOrWords(path).map(String);
  }

  numbers(path: string): number[] {
    return this.numbersOrWords(path).map(Number);
  }

  /** The time codes of all samples of joints, rising. */
  sampleCodes(animation: string): number[] {
    const all = MOVING.flatMap((name) => this.#samples(`${animation}.${name}`)?.times ?? []);
    if (!all.every(Number.isFinite)) throw new Refusal(`${animation} has broken time codes`);
    return [...new Set(all)].sort((a, b) => a - b);
  }

  /** The value at a time code, that of the sample before it; the constant one without samples. */
  sample(path: string, code: number): number[] {
    const samples = this.#samples(path);
    if (!samples) return this.numbers(path);
    const after = samples.times.findIndex((time) => time > code);
    const at = after < 0 ? samples.times.length - 1 : Math.max(after - 1, 0);
    return flat(samples.values[at]).map(Number);
  }

  numbersOrWords(path: string): unknown[] {
    return flat(this.#fields(path)["default"]);
  }

  #samples(path: string): Samples | null {
    const found = this.#fields(path)["timeSamples"] as Samples | undefined;
    return found?.times?.length ? found : null;
  }

  #fields(path: string): Readonly<Record<string, unknown>> {
    return this.#specs[path]?.fields ?? {};
  }
}

function isSome(value: unknown): boolean {
  if (value === undefined || value === null) return false;
  return typeof value !== "object" || Object.keys(value).length > 0;
}

/** The items of an array of any kind, those of arrays within it too. */
function flat(value: unknown): unknown[] {
  if (ArrayBuffer.isView(value)) return [...(value as Float32Array)];
  if (!Array.isArray(value)) return value === undefined || value === null ? [] : [value];
  return value.flatMap((each) =>
    Array.isArray(each) || ArrayBuffer.isView(each) ? flat(each) : [each],
  );
}
