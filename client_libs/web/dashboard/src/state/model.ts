// The protocol types that the dashboard uses.
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

/** A position in metres, in the map's own frame. */
export type Position = [x: number, y: number];

/** The rings of a polygon, outer ring first. Each ring repeats its first position at the end. */
export function ringsOf(polygon: Polygon): Position[][] {
  const rings = polygon.outer ? [polygon.outer, ...polygon.holes] : [];
  return rings.map(({ points }) => {
    const ring = points.map(({ x, y }): Position => [x, y]);
    const first = ring[0];
    if (first) ring.push(first);
    return ring;
  });
}
