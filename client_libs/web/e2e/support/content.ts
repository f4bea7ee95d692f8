import { runsOf, type HypermapClient, type LayerPart } from '@hypermap/client';
import type { Grid } from '@foxglove/schemas';

/** A foxglove.Grid as JSON, whose data is base64. */
export type GridMessage = Omit<Grid, 'data'> & { data: string };

/** The server's own answer: the content of a layer in the map's frame. */
export async function contentOf(
  client: HypermapClient,
  map: string,
  layer: string,
): Promise<LayerPart[]> {
  const far = 1e4;
  const outer = { xs: [-far, far, far, -far], ys: [-far, -far, far, far] };
  const parts: LayerPart[] = [];
  const scope = { map, layers: [layer] };
  for await (const { part } of client.query.queryArea({ scope, area: { outer } })) {
    if (part) parts.push(part);
  }
  return parts;
}

/**
 * The values of known cells, as 32-bit floats, by the places of the cells' lower left corners:
 * "X Y" in whole millimetres.
 */
export type Cells = ReadonlyMap<string, number>;

interface Frame {
  x: number;
  y: number;
  yaw: number;
}

function placeIn({ x, y, yaw }: Frame, along: number, up: number): string {
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  const millimetres = (metres: number) => Math.round(1000 * metres);
  return `${millimetres(x + cos * along - sin * up)} ${millimetres(y + sin * along + cos * up)}`;
}

/** The cells of an answer of the server. */
export function cellsOfAnswer(parts: readonly LayerPart[]): Cells {
  const found = new Map<string, number>();
  for (const { cells } of parts) {
    if (!cells?.grid) continue;
    const { origin, resolutionM } = cells.grid;
    const frame = { x: origin?.x ?? 0, y: origin?.y ?? 0, yaw: origin?.yaw ?? 0 };
    for (const { row, colBegin, colEnd, value } of runsOf(cells)) {
      if (Number.isNaN(value)) continue;
      for (let col = colBegin; col < colEnd; col++) {
        found.set(placeIn(frame, col * resolutionM, row * resolutionM), Math.fround(value));
      }
    }
  }
  return found;
}

/** The cells of a message of the gateway. */
export function cellsOfMessage(grid: GridMessage): Cells {
  const found = new Map<string, number>();
  const { position, orientation } = grid.pose;
  const frame = { ...position, yaw: 2 * Math.atan2(orientation.z, orientation.w) };
  const data = Buffer.from(grid.data, 'base64');
  const offset = grid.fields.find(({ name }) => name === 'value')?.offset ?? NaN;
  for (let row = 0; row * grid.row_stride < data.length; row++) {
    for (let col = 0; col < grid.column_count; col++) {
      const value = data.readFloatLE(row * grid.row_stride + col * grid.cell_stride + offset);
      if (Number.isNaN(value)) continue;
      found.set(placeIn(frame, col * grid.cell_size.x, row * grid.cell_size.y), value);
    }
  }
  return found;
}

/** The first few places at which cells differ, with both values. */
export function differences(some: Cells, others: Cells): string[] {
  const places = new Set([...some.keys(), ...others.keys()]);
  return [...places]
    .filter((place) => some.get(place) !== others.get(place))
    .slice(0, 5)
    .map((place) => `${place}: ${some.get(place)}, ${others.get(place)}`);
}
