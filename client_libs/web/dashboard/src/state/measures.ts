// Areas and bounding boxes of rings and cells, in metres.
import { runsOf, runToGeoJson } from '@hypermap/client';
import type { CellRuns, Position } from './model';

/** Min x, min y, max x, max y. */
export type Box = [number, number, number, number];

/** The area of a ring, which may be closed or open and of either winding. */
export function ringArea(ring: readonly Position[]): number {
  let twice = 0;
  ring.forEach(([x, y], i) => {
    const [nextX, nextY] = ring[(i + 1) % ring.length] ?? [x, y];
    twice += x * nextY - nextX * y;
  });
  return Math.abs(twice) / 2;
}

export interface CellsMeasure {
  count: number;
  areaM2: number;
  box: Box | undefined;
}

export function measureCells(cells: readonly CellRuns[]): CellsMeasure {
  let count = 0;
  let areaM2 = 0;
  const corners: Position[] = [];
  for (const runs of cells) {
    if (!runs.grid) continue;
    let here = 0;
    for (const run of runsOf(runs)) {
      here += run.colEnd - run.colBegin;
      corners.push(...(runToGeoJson(run, runs.grid).coordinates[0] as Position[]));
    }
    count += here;
    areaM2 += here * runs.grid.resolutionM ** 2;
  }
  return { count, areaM2, box: boxAround(corners) };
}

/** The bounding box of some positions. Undefined if there are none. */
export function boxAround(positions: readonly Position[]): Box | undefined {
  if (positions.length === 0) return undefined;
  // There may be more positions than a call can take arguments, so they are not spread into
  // Math.min.
  return positions.reduce<Box>(
    ([x0, y0, x1, y1], [x, y]) => [
      Math.min(x0, x),
      Math.min(y0, y),
      Math.max(x1, x),
      Math.max(y1, y),
    ],
    [Infinity, Infinity, -Infinity, -Infinity],
  );
}
