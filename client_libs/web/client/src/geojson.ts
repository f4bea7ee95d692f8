import { create } from '@bufbuild/protobuf';
import type { Feature, Polygon as GeoJsonPolygon, Position } from 'geojson';
import {
  PolygonSchema,
  RingSchema,
  type Polygon,
  type Ring,
} from './gen/hypermap/v1/geometry_pb.js';
import type { Object$ } from './gen/hypermap/v1/object_pb.js';

/**
 * Converts a polygon. Coordinates stay metres in the frame of the answer, not degrees as in RFC
 * 7946.
 */
export function polygonToGeoJson(polygon: Polygon): GeoJsonPolygon {
  const rings = polygon.outer ? [polygon.outer, ...polygon.holes] : [];
  return { type: 'Polygon', coordinates: rings.map(closedPositions) };
}

/** Converts a polygon. Rings may be closed or open, of either winding; heights are ignored. */
export function polygonFromGeoJson(polygon: GeoJsonPolygon): Polygon {
  const [outer, ...holes] = polygon.coordinates.map(openRing);
  if (!outer) throw new RangeError('a polygon without a ring');
  return create(PolygonSchema, { outer, holes });
}

export interface ObjectProperties {
  label: string;
  classes: Record<string, number>;
  /** The probability that the object exists, in [0, 1]. */
  existence: number;
  tags: string[];
  attributes: Record<string, boolean | bigint | number | string>;
  /** The vertical extent in metres above the plane. */
  height: { low: number; high: number } | undefined;
  version: bigint;
  layer: string;
}

/** Converts an object to a feature. The id becomes a string, because ids have 64 bits. */
export function objectToFeature(
  object: Object$,
  layer: string,
): Feature<GeoJsonPolygon, ObjectProperties> {
  return {
    type: 'Feature',
    id: object.id.toString(),
    geometry: object.polygon
      ? polygonToGeoJson(object.polygon)
      : { type: 'Polygon', coordinates: [] },
    properties: {
      label: object.label,
      classes: { ...object.classes },
      existence: object.existence ?? 1,
      tags: [...object.tags],
      attributes: attributesOf(object),
      height: object.height && { low: object.height.lowM, high: object.height.highM },
      version: object.version,
      layer,
    },
  };
}

function attributesOf(object: Object$): ObjectProperties['attributes'] {
  const attributes: ObjectProperties['attributes'] = {};
  for (const [name, { value }] of Object.entries(object.attributes)) {
    if (value.case !== undefined) attributes[name] = value.value;
  }
  return attributes;
}

function closedPositions(ring: Ring): Position[] {
  const positions = ring.points.map(({ x, y }): Position => [x, y]);
  return positions[0] ? [...positions, [...positions[0]]] : positions;
}

function openRing(positions: Position[]): Ring {
  const points = positions.map(([x = NaN, y = NaN]) => ({ x, y }));
  const first = points[0];
  const last = points.at(-1);
  const closed = points.length > 1 && first?.x === last?.x && first?.y === last?.y;
  return create(RingSchema, { points: closed ? points.slice(0, -1) : points });
}
