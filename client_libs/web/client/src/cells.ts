import type { Polygon as GeoJsonPolygon, Position } from 'geojson';
import type { GridGeometry } from './gen/hypermap/v1/layer_pb.js';
import type { CellRuns } from './gen/hypermap/v1/query_service_pb.js';

/** The cells colBegin <= column < colEnd of a row, which share a value. */
export interface CellRun {
  row: number;
  colBegin: number;
  colEnd: number;
  /** NaN for unknown cells. */
  value: number;
}

/** Iterates over the runs of cells, which the message has in columns. */
export function* runsOf(cells: CellRuns): Generator<CellRun> {
  for (const [i, row] of cells.rows.entries()) {
    yield {
      row,
      colBegin: cells.colBegins[i] ?? 0,
      colEnd: cells.colEnds[i] ?? 0,
      value: cells.values[i] ?? NaN,
    };
  }
}

/** Returns the rectangle that a run covers, in the frame of the grid's origin. */
export function runToGeoJson(run: CellRun, grid: GridGeometry): GeoJsonPolygon {
  const { x = 0, y = 0, yaw = 0 } = grid.origin ?? {};
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  const corner = (column: number, row: number): Position => {
    const [along, up] = [column * grid.resolutionM, row * grid.resolutionM];
    return [x + cos * along - sin * up, y + sin * along + cos * up];
  };
  const ring = [
    corner(run.colBegin, run.row),
    corner(run.colEnd, run.row),
    corner(run.colEnd, run.row + 1),
    corner(run.colBegin, run.row + 1),
    corner(run.colBegin, run.row),
  ];
  return { type: 'Polygon', coordinates: [ring] };
}
