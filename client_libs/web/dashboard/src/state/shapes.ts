// Shapes of objects: their kinds and measures, and the objects that a pointer means.
import { boxAround, ringArea, type Box } from './measures';
import type { Object$, Polygon, Position, Shape } from './model';

/** The kind of a shape, as the field of its message is called. */
export type KindOfShape = NonNullable<Shape['shape']['case']>;

/** All kinds. Shapes of a later kind are drawn above those of an earlier one. */
export const KINDS_OF_SHAPE: readonly KindOfShape[] = ['polygon', 'lineString', 'point'];

/** Coordinates of vertices in columns, as in messages. */
interface Columns {
  xs: readonly number[];
  ys: readonly number[];
}

function positionsOf({ xs, ys }: Columns): Position[] {
  return xs.map((x, i) => [x, ys[i] ?? NaN]);
}

/** The rings of a polygon, outer ring first. They do not repeat their first vertex. */
export function ringsOf({ outer, holes }: Polygon): Columns[] {
  return outer ? [outer, ...holes] : [];
}

/** The kind of an object's shape. Undefined if the dashboard does not know the kind. */
export function kindOf({ shape }: Object$): KindOfShape | undefined {
  return shape?.shape.case;
}

function verticesOf({ shape }: Object$): Position[] {
  const { shape: of } = shape ?? {};
  if (of?.case === 'polygon') return of.value.outer ? positionsOf(of.value.outer) : [];
  if (of?.case === 'lineString') return positionsOf(of.value);
  return of?.case === 'point' ? [[of.value.x, of.value.y]] : [];
}

/** The bounding box of an object. Undefined if it has no shape. */
export function boxOf(object: Object$): Box | undefined {
  return boxAround(verticesOf(object));
}

/** The area of a polygon without its holes, 0 for other shapes. */
export function areaOf({ shape }: Object$): number {
  if (shape?.shape.case !== 'polygon') return 0;
  const [outer = 0, ...holes] = ringsOf(shape.shape.value).map((ring) =>
    ringArea(positionsOf(ring)),
  );
  return holes.reduce((area, hole) => area - hole, outer);
}

/** The length of a line string, 0 for other shapes. */
export function lengthOf({ shape }: Object$): number {
  if (shape?.shape.case !== 'lineString') return 0;
  const { xs, ys } = shape.shape.value;
  let length = 0;
  for (let i = 1; i < xs.length; i++) {
    length += Math.hypot((xs[i] ?? NaN) - (xs[i - 1] ?? NaN), (ys[i] ?? NaN) - (ys[i - 1] ?? NaN));
  }
  return length;
}

function distanceToSegment([x, y]: Position, [ax, ay]: Position, [bx, by]: Position): number {
  const [dx, dy] = [bx - ax, by - ay];
  const squared = dx * dx + dy * dy;
  const along = squared > 0 ? ((x - ax) * dx + (y - ay) * dy) / squared : 0;
  const t = Math.min(1, Math.max(0, along));
  return Math.hypot(x - ax - t * dx, y - ay - t * dy);
}

/** The distance to the nearest of the segments between consecutive vertices. */
function distanceToPath(at: Position, path: readonly Position[]): number {
  let least = Infinity;
  path.forEach((vertex, i) => {
    least = Math.min(least, distanceToSegment(at, path[Math.max(0, i - 1)] ?? vertex, vertex));
  });
  return least;
}

/** A position this close to the boundary of a polygon belongs to it, metres. */
const ON_BOUNDARY_M = 1e-9;

function isCovered(at: Position, polygon: Polygon): boolean {
  const [x, y] = at;
  // A ray from a position inside of the polygon crosses its boundary an odd number of times.
  let isInside = false;
  for (const columns of ringsOf(polygon)) {
    const ring = positionsOf(columns);
    let before = ring.at(-1);
    for (const vertex of ring) {
      const [from, to] = [before ?? vertex, vertex];
      before = vertex;
      if (distanceToSegment(at, from, to) <= ON_BOUNDARY_M) return true;
      if (from[1] > y === to[1] > y) continue;
      const crossing = from[0] + ((y - from[1]) / (to[1] - from[1])) * (to[0] - from[0]);
      if (x < crossing) isInside = !isInside;
    }
  }
  return isInside;
}

/** The distance from a line or a point; 0 in a polygon, infinite beside it. */
function distanceTo({ shape }: Object$, at: Position): number {
  const { shape: of } = shape ?? {};
  if (of?.case === 'polygon') return isCovered(at, of.value) ? 0 : Infinity;
  if (of?.case === 'lineString') return distanceToPath(at, positionsOf(of.value));
  return of?.case === 'point' ? Math.hypot(at[0] - of.value.x, at[1] - of.value.y) : Infinity;
}

/**
 * Whether a pointer at a position means an object. A polygon must cover the position. A line or a
 * point may be as far away as the pointer reaches, because nobody could hit it otherwise.
 */
export function isHit(object: Object$, at: Position, reachM: number): boolean {
  return distanceTo(object, at) <= reachM;
}

/**
 * Returns the objects that a pointer at a position means. Points come before lines and lines before
 * polygons, the nearest point or line and the smallest polygon first: what comes later can be hit
 * elsewhere.
 */
export function objectsAt(objects: Iterable<Object$>, at: Position, reachM: number): Object$[] {
  const hits = [];
  for (const object of objects) {
    const distance = distanceTo(object, at);
    const kind = kindOf(object);
    if (!kind || distance > reachM) continue;
    const size = kind === 'polygon' ? areaOf(object) : distance;
    hits.push({ object, rank: KINDS_OF_SHAPE.indexOf(kind), size });
  }
  hits.sort((a, b) => b.rank - a.rank || a.size - b.size);
  return hits.map(({ object }) => object);
}
