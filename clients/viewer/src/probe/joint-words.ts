/** Words in the names of joints, and the joints of limbs by them, as `posefield probe` reads them. */

const TOKEN = /[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+/g;
const SIDES = new Map<string, Side>([
  ...(["left", "l", "lt", "lft"] as const).map((word) => [word, "left"] as const),
  ...(["right", "r", "rt", "rgt"] as const).map((word) => [word, "right"] as const),
]);
const SIDE_WORD = /^(left|right)(.+)$|^(.+)(left|right)$/;
const REMARK = /\[.*?\]|\(.*?\)/g;
const BEFORE = ["upper", "up", "lower", "low", "fore"];
const HELPERS = words(
  "twist roll ik fk pole target ctrl control nub end eff effector tip share part adj sec muscle weapon prop attach socket share corrective helper dummy ref hipjoint locator marker mch org site aim volume jiggle slide",
);
const DIGITS = words(
  "finger fingers thumb index middle ring pinky little big small digit carpal metacarpal metacarpals",
);
const PREFIX_SHARE = 0.6;
const LONGEST_NAME = 60;
const LIMB_WORDS: Readonly<Record<string, Readonly<Record<string, number>>>> = {
  Shoulder: { clavicle: 1, collar: 1, collarbone: 1, scapula: 0.9, shoulder: 0.8, shldr: 0.6 },
  UpperArm: { upperarm: 1, uparm: 1, uarm: 1, humerus: 1, arm: 0.9, shoulder: 0.7, shldr: 0.75 },
  LowerArm: { lowerarm: 1, lowarm: 1, forearm: 1, farm: 1, radius: 1, elbow: 1 },
  Hand: { hand: 1, wrist: 0.8, palm: 0.8 },
  Fingers: { hand: 0.2, palm: 0.2 },
  UpperLeg: { upperleg: 1, upleg: 1, uleg: 1, thigh: 1, femur: 1, hip: 0.7, leg: 0.5 },
  LowerLeg: { lowerleg: 1, lowleg: 1, calf: 1, shin: 1, tibia: 1, knee: 1, leg: 0.9 },
  Foot: { foot: 1, ankle: 0.9 },
  Toes: { toes: 1, toe: 1, toebase: 1, ball: 1, foot: 0.4 },
};
const TRUNK = "hips hip pelvis neck head chest spine thorax ribcage root";
const KNOWN = new Set([...words(TRUNK), ...Object.values(LIMB_WORDS).flatMap(Object.keys)]);

export type Side = "left" | "right" | "";

/** Meaning of a joint's name. key: the words of the part of the body, joined. */
export interface JointWord {
  readonly side: Side;
  readonly key: string;
  /** Whether the name has no other words. */
  readonly exact: boolean;
  /** Whether it names a twist, a target, an end and the like. */
  readonly helper: boolean;
  /** Whether it names a finger or a single toe. */
  readonly digit: boolean;
}

/** How well a name fits a role without its side, 0 to 1. */
export function score(word: JointWord, role: string): number {
  if (word.helper) return 0;
  if (word.digit) return role === "Fingers" ? 0.3 : 0;
  if (role === "Toes" && word.key === "foot" && !word.exact) return 0;
  const own = LIMB_WORDS[role]!;
  return (Object.hasOwn(own, word.key) ? own[word.key]! : 0) * (word.exact ? 1 : 0.85);
}

/** The meaning of each name; words with which most names begin or end are left out. */
export function jointWords(names: readonly string[]): JointWord[] {
  let split = names.map(tokens);
  for (const last of [false, true]) {
    for (let word = common(split, last); word; word = common(split, last)) {
      const dropped = word;
      split = split.map((all) => without(all, dropped, last));
    }
  }
  return split.map(meaning);
}

function words(text: string): ReadonlySet<string> {
  return new Set(text.split(" "));
}

function at(all: readonly string[], last: boolean): string {
  return all.at(last ? -1 : 0)!;
}

function without(all: string[], word: string, last: boolean): string[] {
  if (all.length < 2 || at(all, last) !== word) return all;
  return last ? all.slice(0, -1) : all.slice(1);
}

function tokens(name: string): string[] {
  const whole = name.slice(name.lastIndexOf(":") + 1).slice(-LONGEST_NAME);
  const bare = whole.replace(REMARK, "") || whole;
  const found = (bare.match(TOKEN) ?? []).flatMap((token) => {
    const word = token.toLowerCase();
    const parts = SIDE_WORD.exec(word);
    return parts ? parts.slice(1).filter(Boolean) : [word];
  });
  return found.filter((word) => SIDES.has(word) || (word.length > 1 && !/^\d+$/.test(word)));
}

/** The word of a tool with which most names begin or end. */
function common(split: readonly (readonly string[])[], last: boolean): string | null {
  const counts = new Map<string, number>();
  for (const all of split)
    if (all.length > 1) counts.set(at(all, last), (counts.get(at(all, last)) ?? 0) + 1);
  const [most] = [...counts].sort((a, b) => b[1] - a[1]);
  if (!most || split.length <= 2 || most[1] < PREFIX_SHARE * split.length) return null;
  const [word] = most;
  const means = SIDES.has(word) || KNOWN.has(word) || BEFORE.includes(word) || DIGITS.has(word);
  return means ? null : word;
}

function meaning(all: readonly string[]): JointWord {
  const [side, own] = sided(all);
  const helper = own.some((word) => HELPERS.has(word));
  const digit = own.some((word) => DIGITS.has(word));
  const rest = [
    ...own.filter((word) => BEFORE.includes(word)),
    ...own.filter((word) => !BEFORE.includes(word)),
  ];
  const joined = rest.join("");
  if (KNOWN.has(joined)) return { side, key: joined, exact: true, helper, digit };
  let known = "";
  for (let from = 0; from < rest.length; from++)
    for (let to = from + 1; to <= rest.length; to++) {
      const part = rest.slice(from, to).join("");
      if (KNOWN.has(part) && part.length > known.length) known = part;
    }
  return { side, key: known || joined, exact: !known, helper, digit };
}

function sided(all: readonly string[]): [Side, readonly string[]] {
  const index = all.findIndex((word) => SIDES.has(word));
  if (index >= 0 && all.length > 1)
    return [SIDES.get(all[index]!)!, all.filter((_, each) => each !== index)];
  const joined = all.join("");
  if (!KNOWN.has(joined))
    for (const [letter, rest] of [
      [joined.slice(0, 1), joined.slice(1)],
      [joined.slice(-1), joined.slice(0, -1)],
    ] as const)
      if ((letter === "l" || letter === "r") && isLimb(rest)) return [SIDES.get(letter)!, [rest]];
  return ["", all];
}

function isLimb(word: string): boolean {
  return KNOWN.has(word) || HELPERS.has(word) || DIGITS.has(word);
}
