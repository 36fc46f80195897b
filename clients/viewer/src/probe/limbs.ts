/** Joints of legs and head by their names and the tree, as `posefield probe` finds them. */

import { type JointWord, jointWords, score } from "./joint-words.ts";

const ARM = ["Shoulder", "UpperArm", "LowerArm", "Hand", "Fingers"];
const LEG = ["UpperLeg", "LowerLeg", "Foot", "Toes"];
const NEEDED = new Set(["UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot"]);
const LACK = 0.5;
const LEAST_GAIN = 1e-9;
/** Scores where joints bear the names of joints (knee, elbow), not of bones. */
const JOINT_NAMED: Readonly<Record<string, number>> = { "Hand wrist": 1.2, "Foot ankle": 1.1 };

type Parents = readonly number[];
type Picks = ReadonlyMap<string, number>;

/** Joints by role (`leftFoot`, `head`): those of legs and arms, and the head. */
export function limbs(names: readonly string[], parents: Parents): ReadonlyMap<string, number> {
  const words = jointWords(names);
  const found = new Map<string, number>();
  const leaves = names.map((_, joint) => joint).filter((joint) => !parents.includes(joint));
  for (const side of ["left", "right"] as const) {
    const paths = leaves.map((leaf) =>
      pathTo(parents, leaf).filter((joint) => words[joint]!.side === side),
    );
    for (const roles of [ARM, LEG])
      for (const [role, joint] of alignLimb(paths, words, roles)) found.set(side + role, joint);
  }
  const head = headOf(words, parents, found);
  if (head !== null) found.set("head", head);
  return found;
}

/** The joints from the root to one of them. */
export function pathTo(parents: Parents, joint: number): number[] {
  const found: number[] = [];
  for (let each = joint; each >= 0; each = parents[each]!) found.push(each);
  return found.reverse();
}

function alignLimb(
  paths: readonly (readonly number[])[],
  words: readonly JointWord[],
  roles: readonly string[],
): ReadonlyMap<string, number> {
  let top = 0;
  let best: ReadonlyMap<string, number> = new Map();
  for (const path of paths) {
    const way = path.filter((joint) => roles.some((role) => score(words[joint]!, role)));
    const [total, picks] = align(scores(way, words, roles), roles);
    if (total <= top + LEAST_GAIN) continue;
    top = total;
    best = new Map([...picks].map(([role, at]) => [role, way[at]!]));
  }
  return new Map([...best].filter(([role]) => role !== "Fingers"));
}

function scores(way: readonly number[], words: readonly JointWord[], roles: readonly string[]) {
  const byJoints = way.some((joint) => ["elbow", "knee"].includes(words[joint]!.key));
  return way.map((joint) => {
    const word = words[joint]!;
    return new Map(
      roles.map((role) => {
        const own = score(word, role);
        const named = byJoints && word.exact ? JOINT_NAMED[`${role} ${word.key}`] : undefined;
        return [role, own && (named ?? own)] as const;
      }),
    );
  });
}

/** The best total score and the joint of each role, in their order; of equals that nearest the root. */
function align(own: readonly ReadonlyMap<string, number>[], roles: readonly string[]) {
  let totals: [number, Picks][] = Array.from({ length: own.length + 1 }, () => [0, new Map()]);
  for (const role of roles) {
    const lack = NEEDED.has(role) ? LACK : 0;
    const following: [number, Picks][] = [[totals[0]![0] - lack, totals[0]![1]]];
    own.forEach((each, at) => {
      const skipped: [number, Picks] = [totals[at + 1]![0] - lack, totals[at + 1]![1]];
      const before = following.at(-1)!;
      let choice = skipped[0] > before[0] ? skipped : before;
      const gained = each.get(role);
      if (gained) {
        const total = totals[at]![0] + gained;
        if (total > choice[0] + LEAST_GAIN)
          choice = [total, new Map([...totals[at]![1], [role, at]])];
      }
      following.push(choice);
    });
    totals = following;
  }
  return totals.at(-1)!;
}

/** The joint named as head; without head and neck, the last of a chain above the arms. */
function headOf(words: readonly JointWord[], parents: Parents, found: Picks): number | null {
  const named = words
    .map((word, joint) => ({ word, joint }))
    .filter(({ word }) => word.key === "head" && !word.side && !word.helper && !word.digit);
  const first = named.find(({ word }) => word.exact) ?? named[0];
  if (first) return first.joint;
  if (words.some((word) => !word.side && word.key.replaceAll("lower", "").startsWith("neck")))
    return null;
  const arms = ["left", "right"].map(
    (side) => found.get(`${side}Shoulder`) ?? found.get(`${side}UpperArm`),
  );
  return arms.every((arm) => arm !== undefined)
    ? topOfChain(words, parents, arms as [number, number])
    : null;
}

function topOfChain(
  words: readonly JointWord[],
  parents: Parents,
  [left, right]: [number, number],
): number | null {
  const paths = [pathTo(parents, left), pathTo(parents, right)] as const;
  const shared = paths[0].filter((joint, depth) => paths[1][depth] === joint).at(-1);
  if (shared === undefined) return null;
  const { key } = words[shared]!;
  const above: number[] = [];
  for (let last = shared; ; last = above.at(-1)!) {
    const next = parents
      .map((_, joint) => joint)
      .filter((joint) => parents[joint] === last && words[joint]!.key === key)
      .filter((joint) => !words[joint]!.side);
    if (next.length !== 1) break;
    above.push(next[0]!);
  }
  return above.length > 1 ? above.at(-1)! : null;
}
