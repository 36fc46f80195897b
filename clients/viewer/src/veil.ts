/** Where a map has no support: the shape that is hatched, and its outline. */

export type Place = readonly [x: number, y: number];

/** Places in columns and rows of a grid, whose numbers stand on whole ones. */
export interface Shape {
  readonly area: readonly (readonly Place[])[];
  readonly edges: readonly (readonly [Place, Place])[];
}

const CORNERS = [
  [0, 0],
  [1, 0],
  [1, 1],
  [0, 1],
] as const;

/** What is not supported, half-way to what is (marching squares). */
export function shape(supported: readonly (readonly boolean[])[]): Shape {
  const area: Place[][] = [];
  const edges: [Place, Place][] = [];
  for (let row = 0; row + 1 < supported.length; row++) {
    for (let column = 0; column + 1 < supported[0]!.length; column++) {
      const corners = CORNERS.map(([x, y]): Place => [column + x, row + y]);
      const { places, ways } = square(corners, ([x, y]) => supported[y]![x]!);
      if (places.length) area.push(places);
      edges.push(...ways);
    }
  }
  return { area, edges };
}

/** Once around a square: what of it is not supported, and the ways across that part the two. */
function square(corners: readonly Place[], held: (place: Place) => boolean) {
  const places: Place[] = [];
  const crossings: Place[] = [];
  for (const [i, from] of corners.entries()) {
    const to = corners[(i + 1) % corners.length]!;
    if (!held(from)) places.push(from);
    if (held(from) === held(to)) continue;
    const middle: Place = [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2];
    places.push(middle);
    crossings.push(middle);
  }
  // By turns the area is left and entered again.
  if (held(corners[0]!)) crossings.push(...crossings.splice(0, 1));
  const ways = crossings.flatMap((from, i): [Place, Place][] =>
    i % 2 ? [] : [[from, crossings[i + 1]!]],
  );
  return { places, ways };
}

/** The same as paths, and the size of their grid. */
export interface Veil {
  readonly area: Path2D;
  readonly edge: Path2D;
  readonly columns: number;
  readonly rows: number;
}

export function veil(supported: readonly (readonly boolean[])[]): Veil {
  const found = shape(supported);
  const [area, edge] = [new Path2D(), new Path2D()];
  for (const places of found.area) trace(area, places).closePath();
  for (const way of found.edges) trace(edge, way);
  return { area, edge, columns: supported[0]!.length, rows: supported.length };
}

function trace(path: Path2D, [first, ...rest]: readonly Place[]): Path2D {
  path.moveTo(...first!);
  for (const place of rest) path.lineTo(...place);
  return path;
}
