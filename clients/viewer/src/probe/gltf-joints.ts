/** The joints of a glTF file: those of its skins with the nodes between them, or the animated tree. */

import type { GltfDocument, GltfNode } from "./gltf-document.ts";
import { MOST_JOINTS, type Pose, Refusal } from "./motion.ts";

/** nodes: of the joints, parents first. outer: nodes above the first. rest: of outer and joints. */
export interface GltfJoints {
  readonly nodes: readonly number[];
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly outer: readonly number[];
  readonly rest: Required<Pose>;
  readonly notes: readonly string[];
}

type Above = ReadonlyMap<number, number>;

export function jointsOf(document: GltfDocument, animated: ReadonlySet<number>): GltfJoints {
  const { nodes = [], skins = [] } = document.parts;
  const above = parentsOf(nodes);
  const [root, members] = skins.length
    ? skinned(document, above)
    : animatedTree(nodes, above, animated);
  const order = below(nodes, root).filter((node) => members.has(node));
  if (order.length > MOST_JOINTS)
    throw new Refusal(`found ${order.length} joints, expected at most ${MOST_JOINTS}`);
  const places = new Map(order.map((node, joint) => [node, joint]));
  const outer = ancestors(above, root).slice(1).reverse();
  const { names, unnamed } = namesOf(nodes, order);
  const notes = [
    ...(skins.length ? [] : ["no skin: the tree of animated nodes was taken as the skeleton"]),
    ...(unnamed
      ? [`${unnamed} joints without a name of their own were named after their nodes`]
      : []),
  ];
  const parents = order.map((node, joint) => (joint ? places.get(above.get(node)!)! : -1));
  return { nodes: order, names, parents, outer, rest: restOf(nodes, [...outer, ...order]), notes };
}

function parentsOf(nodes: readonly GltfNode[]): Above {
  const above = new Map<number, number>();
  for (const [parent, { children = [] }] of nodes.entries())
    for (const child of children) {
      if (above.has(child) || !nodes[child])
        throw new Refusal(`node ${child} is no child of one node, expected a tree`);
      above.set(child, parent);
    }
  for (const start of nodes.keys()) {
    const seen = new Set([start]);
    for (let node = above.get(start); node !== undefined; node = above.get(node)) {
      if (seen.has(node)) throw new Refusal(`node ${node} is its own ancestor, expected a tree`);
      seen.add(node);
    }
  }
  return above;
}

/** A node and its ancestors, the scene's root last. */
function ancestors(above: Above, node: number): number[] {
  const found = [node];
  for (let each = above.get(node); each !== undefined; each = above.get(each)) found.push(each);
  return found;
}

/** A node and its descendants, parents first, in the order of the file. */
function below(nodes: readonly GltfNode[], root: number): number[] {
  const found: number[] = [];
  const ahead = [root];
  while (ahead.length) {
    const node = ahead.pop()!;
    found.push(node);
    ahead.push(...(nodes[node]!.children ?? []).toReversed());
  }
  return found;
}

function commonAncestor(above: Above, nodes: readonly number[]): number | null {
  const [first, ...others] = nodes.map((node) => ancestors(above, node).reverse());
  const shared = (first ?? []).filter((node, depth) => others.every((way) => way[depth] === node));
  return shared.at(-1) ?? null;
}

/** The nodes with all nodes between them and the root. */
function between(above: Above, nodes: Iterable<number>, root: number): Set<number> {
  const found = new Set([root]);
  for (const start of nodes)
    for (let node = start; !found.has(node); node = above.get(node)!) found.add(node);
  return found;
}

function skinned({ parts }: GltfDocument, above: Above): [number, Set<number>] {
  const nodes = parts.nodes ?? [];
  let groups: Set<number>[] = [];
  for (const { joints: own = [] } of parts.skins ?? []) {
    if (!own.length || own.some((node) => !nodes[node]))
      throw new Refusal("found a skin without joints, expected some");
    const root = commonAncestor(above, own);
    const tree = root === null ? new Set(own) : between(above, own, root);
    const touches = (group: Set<number>) => [...group].some((node) => tree.has(node));
    const apart = groups.filter((group) => !touches(group));
    const joined = groups.filter(touches);
    groups = [...apart, new Set([...tree, ...joined.flatMap((group) => [...group])])];
  }
  if (groups.length > 1) {
    const named = groups.map((group) => nodes[Math.min(...group)]!.name || Math.min(...group));
    throw new Refusal(
      `found ${groups.length} skeletons (${named.join(", ")}), expected one: export each character alone`,
    );
  }
  const root = commonAncestor(above, [...groups[0]!]);
  if (root === null) throw new Refusal("found joints without a common root, expected one tree");
  return [root, between(above, groups[0]!, root)];
}

/** The root of the animated nodes, and all nodes below it that draw nothing. */
function animatedTree(
  nodes: readonly GltfNode[],
  above: Above,
  animated: ReadonlySet<number>,
): [number, Set<number>] {
  const root = animated.size ? commonAncestor(above, [...animated]) : null;
  if (root === null)
    throw new Refusal("found no skin and no tree of animated nodes, expected a skeleton");
  const members = new Set<number>();
  for (const node of below(nodes, root)) {
    const { mesh, camera } = nodes[node]!;
    const held = node === root || members.has(above.get(node)!);
    if (held && mesh === undefined && camera === undefined) members.add(node);
  }
  if (members.size < 2)
    throw new Refusal(
      `found an animation of node '${nodes[root]!.name ?? root}' without a skeleton, expected a skin or a tree of nodes`,
    );
  return [root, members];
}

function namesOf(nodes: readonly GltfNode[], order: readonly number[]) {
  const names: string[] = [];
  let unnamed = 0;
  for (const node of order) {
    const { name } = nodes[node]!;
    const own = name && !names.includes(name) ? name : `${name || "joint"}_${node}`;
    if (own !== name) unnamed++;
    names.push(own);
  }
  return { names, unnamed };
}

function restOf(nodes: readonly GltfNode[], order: readonly number[]): Required<Pose> {
  const all = order.map((index) => transform(nodes[index]!, index));
  return {
    places: Float64Array.from(all.flatMap(({ place }) => place)),
    turns: Float64Array.from(all.flatMap(({ turn }) => turn)),
    scales: Float64Array.from(all.flatMap(({ size }) => size)),
  };
}

function transform(node: GltfNode, index: number) {
  const { translation = [0, 0, 0], rotation = [0, 0, 0, 1], scale = [1, 1, 1], matrix } = node;
  if (!matrix) {
    const length = Math.hypot(...rotation);
    if (!(length > 0))
      throw new Refusal(`node ${index} has rotation 0, expected a unit quaternion`);
    return { place: translation, turn: rotation.map((each) => each / length), size: scale };
  }
  const columns = [0, 4, 8].map((at) => matrix.slice(at, at + 3));
  const size = columns.map((column) => Math.hypot(...column) || 1);
  const axes = columns.map((column, at) => column.map((each) => each / size[at]!));
  return { place: matrix.slice(12, 15), turn: turnOf(axes), size };
}

/** The turn x y z w of three perpendicular axes. */
function turnOf(axes: readonly (readonly number[])[]): number[] {
  const [a, b, c] = axes as [number[], number[], number[]];
  const [xx, yy, zz] = [a[0]!, b[1]!, c[2]!];
  const parts = [
    Math.sqrt(Math.max(0, 1 + xx - yy - zz)) / 2,
    Math.sqrt(Math.max(0, 1 - xx + yy - zz)) / 2,
    Math.sqrt(Math.max(0, 1 - xx - yy + zz)) / 2,
    Math.sqrt(Math.max(0, 1 + xx + yy + zz)) / 2,
  ] as const;
  const best = parts.indexOf(Math.max(...parts));
  const [sx, sy, sz] = [b[2]! - c[1]!, c[0]! - a[2]!, a[1]! - b[0]!];
  const [xy, xz, yz] = [a[1]! + b[0]!, a[2]! + c[0]!, b[2]! + c[1]!];
  const rows = [
    [0, xy, xz, sx],
    [xy, 0, yz, sy],
    [xz, yz, 0, sz],
    [sx, sy, sz, 0],
  ] as const;
  return rows[best]!.map((each, at) => (at === best ? parts[best]! : each / (4 * parts[best]!)));
}
