/** What is said of a motion file: facts with their confidence and evidence, or why it is refused. */

import { readMotion } from "./formats.ts";
import type { Beside } from "./gltf-document.ts";
import { type Motion, Refusal, type Take } from "./motion.ts";
import { general, plain } from "./numbers.ts";
import { type Confidence, Figure, proposeRate, proposeUnit, proposeUp } from "./proposals.ts";

/** key: the setting of a recipe, or what the row is about. */
export interface Fact {
  readonly key: string;
  readonly word: string;
  readonly value: string;
  readonly confidence: Confidence | null;
  readonly evidence: readonly string[];
}

export interface Report {
  readonly file: string;
  /** In one line: what it is, or why it is not read. */
  readonly said: string;
  readonly refused: boolean;
  readonly facts: readonly Fact[];
  readonly warnings: readonly string[];
  readonly notes: readonly string[];
}

const SHOWN_JOINTS = 40;
const LICENCE: Fact = {
  key: "licence",
  word: "Licence",
  value: "unknown",
  confidence: "none",
  evidence: ["motion files state no licence: ask their author"],
};

/** Says what a file is; among: the files that came with it. */
export async function report(file: File, among: readonly File[]): Promise<Report> {
  const beside: Beside = (name) => among.find((other) => other.name === name) ?? null;
  try {
    return described(file.name, await readMotion(file, beside));
  } catch (fault) {
    const said = fault instanceof Refusal ? fault.message : `breaks its format: ${fault}`;
    return { file: file.name, said, refused: true, facts: [], warnings: [], notes: [] };
  }
}

function described(file: string, motion: Motion): Report {
  const figure = new Figure(motion);
  const { names, takes, warnings, notes } = motion;
  const first = takes[0];
  const unit = proposeUnit(figure);
  const up = proposeUp(figure);
  const rate = proposeRate(motion);
  const row = (key: string, word: string, value: string): Fact => ({
    key,
    word,
    value,
    confidence: null,
    evidence: [],
  });
  const facts: Fact[] = [
    ...(names.length ? [row("joints", `Joints (${names.length})`, joints(names))] : []),
    ...(takes.length > 1 ? [listed(takes)] : []),
    ...(names.length
      ? [
          {
            ...row(
              "metres_per_unit",
              "Unit",
              unit.value === null ? "unknown" : `${plain(unit.value)} m`,
            ),
            ...sure(unit),
          },
          { ...row("up", "Up axis", up.value ?? "unknown"), ...sure(up) },
        ]
      : []),
    {
      ...row(
        "fps",
        "Rate",
        rate.value === null ? "unknown" : `${plain(rate.value)} frames a second`,
      ),
      ...sure(rate),
    },
    ...travel(motion, unit.value, up.value),
    ...(motion.meshes ? [row("meshes", "Meshes", meshes(motion.meshes))] : []),
    LICENCE,
  ];
  const counted = first ? `, ${first.frames} frames, ${seconds(first)} s` : ", no motion";
  return {
    file,
    said: `${motion.format} file${counted}`,
    refused: false,
    facts,
    warnings: [...warnings, ...staying(motion)],
    notes,
  };
}

function sure({ confidence, evidence }: Pick<Fact, "confidence" | "evidence">) {
  return { confidence, evidence };
}

function seconds({ frames, fps }: Take): string {
  return fps === null ? "unknown" : ((frames - 1) / fps).toFixed(2);
}

function joints(names: readonly string[]): string {
  const shown = names.slice(0, SHOWN_JOINTS).join(", ");
  return names.length > SHOWN_JOINTS ? `${shown} and ${names.length - SHOWN_JOINTS} more` : shown;
}

function listed(takes: readonly Take[]): Fact {
  const evidence = takes
    .slice(0, SHOWN_JOINTS)
    .map((take) => `${take.name}: ${take.frames} frames, ${seconds(take)} s`);
  return {
    key: "animations",
    word: "Animations",
    value: String(takes.length),
    confidence: null,
    evidence,
  };
}

function meshes({ all, skinned }: { all: number; skinned: number }): string {
  return all ? `${all}, ${skinned} of them on the skeleton` : "none";
}

/** How far the root comes, across the floor where the up axis is known. */
function travel({ positions, takes }: Motion, unit: number | null, up: string | null): Fact[] {
  const [first, last] = [positions[0], positions.at(-1)];
  if (!first?.length || !last || !takes.length) return [];
  const upward = up ? "xyz".indexOf(up) : -1;
  const axes = [0, 1, 2].filter((axis) => axis !== upward);
  const length = Math.hypot(...axes.map((axis) => last[axis]! - first[axis]!));
  const size = unit === null ? `${general(length, 4)} units` : `${(length * unit).toFixed(2)} m`;
  const value = `${size} from the first frame to the last${up ? ", across the floor" : ""}`;
  return [{ key: "travel", word: "Root travels", value, confidence: null, evidence: [] }];
}

function staying({ moves, names }: Motion): string[] {
  const mover = moves[0] ? -1 : moves.indexOf(true);
  if (mover < 0) return [];
  return [
    `the root '${names[0]}' stays in place while '${names[mover]}' moves: make '${names[mover]}' the root, or its motion is lost`,
  ];
}
