// The words of the wire that the dashboard uses, in one place.
export {
  AnswerStatus,
  CellRule,
  ChangeKind,
  LayerKind,
  type CellRuns,
  type Change,
  type GridGeometry,
  type Layer,
  type LayerPart,
  type Object$,
  type Polygon,
  type RevisionInfo,
  type WatchResponse,
} from '@hypermap/client';

import type { Polygon } from '@hypermap/client';

/** Metres in the map's own frame. */
export type Position = [x: number, y: number];

/** Rings of a polygon, the outer one first. Closed: the first position comes again at the end. */
export function ringsOf(polygon: Polygon): Position[][] {
  const rings = polygon.outer ? [polygon.outer, ...polygon.holes] : [];
  return rings.map(({ points }) => {
    const ring = points.map(({ x, y }): Position => [x, y]);
    const first = ring[0];
    if (first) ring.push(first);
    return ring;
  });
}
