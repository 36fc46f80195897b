/** Names of options: a misspelt one is refused, with the known name that is most like it. */

import { WrongQuestion } from "./errors.ts";
import { KEYS } from "./schema.ts";

export type QuestionKind = keyof typeof KEYS;

/** Longer names are not compared, which takes quadratic time. */
const LONGEST = 40;

/** WrongQuestion for the first key that a question of its kind does not have. */
export function checkQuestion(kind: QuestionKind, question: object): void {
  checkNames(kind, KEYS[kind], question);
  if ("targets" in question && Array.isArray(question.targets)) {
    for (const target of question.targets) checkNames("Target", KEYS.Target, target);
  }
  if ("floor" in question && typeof question.floor === "object" && question.floor) {
    checkNames("Floor", KEYS.Floor, question.floor);
  }
}

/** WrongQuestion for the first key that is not among the known names. */
export function checkNames(what: string, known: readonly string[], given: object): void {
  const unknown = Object.keys(given).find((name) => !known.includes(name));
  if (unknown === undefined) return;
  const near = similarName(unknown, known);
  const hint = near === undefined ? "" : ` (did you mean ${near}?)`;
  throw new WrongQuestion(
    `${what}: found ${unknown.slice(0, LONGEST)}${hint}, expected some of ${known.join(", ")}`,
  );
}

/**
 * The only known name that begins with this one, or the one that differs least, by at most a third
 * of the letters; none for a tie.
 */
export function similarName(name: string, known: readonly string[]): string | undefined {
  if (name.length > LONGEST) return undefined;
  const wanted = name.toLowerCase();
  const begun = known.filter((each) => wanted && each.toLowerCase().startsWith(wanted));
  if (begun.length === 1) return begun[0];
  const most = Math.max(1, Math.floor(name.length / 3));
  const apart = known.map((each) => distance(wanted, each.toLowerCase()));
  const least = Math.min(...apart);
  const near = known.filter((_, place) => apart[place] === least);
  return least <= most && near.length === 1 ? near[0] : undefined;
}

/**
 * Number of letters to insert, delete, replace or swap with their neighbour (optimal string
 * alignment).
 */
function distance(a: string, b: string): number {
  const rows = [Array.from({ length: b.length + 1 }, (_, place) => place)];
  const at = (i: number, j: number) => rows[i]?.[j] ?? Number.POSITIVE_INFINITY;
  for (let i = 1; i <= a.length; i += 1) {
    const row = [i];
    rows.push(row);
    for (let j = 1; j <= b.length; j += 1) {
      const replaced = at(i - 1, j - 1) + (a[i - 1] === b[j - 1] ? 0 : 1);
      const swapped =
        a[i - 1] === b[j - 2] && a[i - 2] === b[j - 1] ? at(i - 2, j - 2) + 1 : replaced;
      row.push(Math.min(replaced, swapped, at(i - 1, j) + 1, at(i, j - 1) + 1));
    }
  }
  return at(a.length, b.length);
}
