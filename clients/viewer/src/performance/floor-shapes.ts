/** What is drawn on the floor for a performance. */

import {
  BufferGeometry,
  CircleGeometry,
  DoubleSide,
  Float32BufferAttribute,
  type Group,
  Line,
  LineDashedMaterial,
  Mesh,
  MeshBasicMaterial,
  type Object3D,
  RingGeometry,
  SphereGeometry,
} from "three";

import * as theme from "../theme.ts";
import type { Performed } from "./answers.ts";
import { isPoint, points, type Script } from "./script.ts";

/** Above the floor, m, so that the floor hides none of it. */
const [PATH, DISC] = [0.008, 0.012];
const SIZE = 0.09;
/** Half the width of the way, m. */
const WIDE = 0.02;

/** The way of the root, a line for each segment; that of the chosen one stands out. */
export function lines({ report, track }: Performed, selected: number): Object3D[] {
  const { rate, rootPosition, times } = track;
  return report.segments.map(({ begins, ends }, index) => {
    const first = Math.max(0, Math.floor(begins * rate));
    const last = Math.min(times.length - 1, Math.ceil(ends * rate));
    const own = index === selected;
    const way = rootPosition.subarray(3 * first, 3 * (last + 1));
    return ribbon(way, own ? WIDE : 0.6 * WIDE, own ? "--accent" : "--soft");
  });
}

/** Points of all walks, and obstacles; those of the chosen walk are large, wrong ones marked. */
export function discs(
  { obstacles = [], segments, start }: Script,
  selected: number,
  wrong: ReadonlySet<number>,
): Object3D[] {
  const found = segments.flatMap((segment, index) => {
    const own = index === selected;
    return points(segment).map(([x, z], i) => {
      const colour = own ? (wrong.has(i) ? "--warn" : "--accent") : "--soft";
      const size = own ? (wrong.has(i) ? 1.5 * SIZE : SIZE) : 0.6 * SIZE;
      return flat(new CircleGeometry(size, 24), colour, x, z);
    });
  });
  const [x, z] = isPoint(start?.position) ? start.position : [0, 0];
  found.push(flat(new RingGeometry(0.7 * SIZE, SIZE, 24), "--ink", x, z));
  for (const { position, radius } of Array.isArray(obstacles) ? obstacles : [])
    if (isPoint(position) && radius > 0)
      found.push(
        flat(new RingGeometry(0.96 * radius, radius, 48), "--warn", position[0], position[1]),
      );
  return found;
}

/** Targets in the world: a ball and a dashed line to the floor. */
export function targets({ segments }: Script): Object3D[] {
  return segments.flatMap((segment) => {
    if (segment.kind !== "act" || !Array.isArray(segment.targets)) return [];
    return segment.targets
      .filter(({ frame, position }) => frame !== "segment" && position?.length === 3)
      .flatMap(({ position: [x, y, z] }) => {
        const colour = theme.colour("--warn");
        const ball = new Mesh(
          new SphereGeometry(0.04, 20, 14),
          new MeshBasicMaterial({ color: colour }),
        );
        ball.position.set(x, y, z);
        return [ball, stem([x, 0, z, x, y, z], "--warn")];
      });
  });
}

/** Takes all away, and gives back what it took on the graphics card. */
export function clear(group: Group): void {
  for (const each of [...group.children] as (Mesh<BufferGeometry, MeshBasicMaterial> | Line)[]) {
    each.removeFromParent();
    each.geometry.dispose();
    (each.material as MeshBasicMaterial).dispose();
  }
}

/** A way along the floor (F × 3, m) as a strip of that half width, for lines are a pixel wide. */
function ribbon(way: Float32Array, half: number, colour: string): Mesh {
  const [places, corners]: [number[], number[]] = [[], []];
  const last = way.length / 3 - 1;
  for (let frame = 0; frame <= last; frame++) {
    const [before, after] = [3 * Math.max(0, frame - 1), 3 * Math.min(last, frame + 1)];
    const [dx, dz] = [way[after]! - way[before]!, way[after + 2]! - way[before + 2]!];
    const share = half / (Math.hypot(dx, dz) || 1);
    const [x, z] = [way[3 * frame]!, way[3 * frame + 2]!];
    places.push(x + share * dz, PATH, z - share * dx, x - share * dz, PATH, z + share * dx);
    const at = 2 * frame;
    if (frame < last) corners.push(at, at + 1, at + 2, at + 1, at + 3, at + 2);
  }
  const geometry = new BufferGeometry().setIndex(corners);
  geometry.setAttribute("position", new Float32BufferAttribute(places, 3));
  const look = { color: theme.colour(colour), side: DoubleSide };
  return new Mesh(geometry, new MeshBasicMaterial(look));
}

function stem(places: readonly number[], colour: string): Line {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(places, 3));
  const look = { color: theme.colour(colour), dashSize: 0.06, gapSize: 0.05 };
  return new Line(geometry, new LineDashedMaterial(look)).computeLineDistances();
}

function flat(geometry: BufferGeometry, colour: string, x: number, z: number): Mesh {
  const made = new Mesh(geometry, new MeshBasicMaterial({ color: theme.colour(colour) }));
  made.rotation.x = -Math.PI / 2;
  made.position.set(x, DISC, z);
  return made;
}
