import { create } from '@bufbuild/protobuf';
import type {
  Feature,
  LineString as GeoJsonLineString,
  Point as GeoJsonPoint,
  Polygon as GeoJsonPolygon,
  Position,
} from 'geojson';
import {
  LineStringSchema,
  PointSchema,
  PolygonSchema,
  RingSchema,
  ShapeSchema,
  type LineString,
  type Point,
  type Polygon,
  type Ring,
  type Shape,
} from './gen/hypermap/v1/geometry_pb.js';
import type { Object$ } from './gen/hypermap/v1/object_pb.js';

// Coordinates stay metres in the frame of the answer, not degrees as in RFC 7946. Heights of
// positions are ignored.

/** The geometries that the shapes of objects convert to and from. */
export type ShapeGeometry = GeoJsonPolygon | GeoJsonLineString | GeoJsonPoint;

/** Converts a shape. Returns null for a kind of shape that this version does not know. */
export function shapeToGeoJson({ shape }: Shape): ShapeGeometry | null {
  switch (shape.case) {
    case 'polygon':
      return polygonToGeoJson(shape.value);
    case 'lineString':
      return lineStringToGeoJson(shape.value);
    case 'point':
      return pointToGeoJson(shape.value);
    default:
      return null;
  }
}

/** Converts a geometry to a shape. Throws a RangeError for any other type of geometry. */
export function shapeFromGeoJson(geometry: ShapeGeometry): Shape {
  return create(ShapeSchema, { shape: shapeOf(geometry) });
}

function shapeOf(geometry: ShapeGeometry): Shape['shape'] {
  switch (geometry.type) {
    case 'Polygon':
      return { case: 'polygon', value: polygonFromGeoJson(geometry) };
    case 'LineString':
      return { case: 'lineString', value: lineStringFromGeoJson(geometry) };
    case 'Point':
      return { case: 'point', value: pointFromGeoJson(geometry) };
    default:
      // The geometry may come from a file that no type checker has seen.
      throw new RangeError(`a shape cannot be a ${(geometry as { type: string }).type}`);
  }
}

export function polygonToGeoJson(polygon: Polygon): GeoJsonPolygon {
  const rings = polygon.outer ? [polygon.outer, ...polygon.holes] : [];
  return { type: 'Polygon', coordinates: rings.map(closedPositions) };
}

/** Converts a polygon. Rings may be closed or open, of either winding. */
export function polygonFromGeoJson(polygon: GeoJsonPolygon): Polygon {
  const [outer, ...holes] = polygon.coordinates.map(openRing);
  if (!outer) throw new RangeError('the polygon has no ring');
  return create(PolygonSchema, { outer, holes });
}

export function lineStringToGeoJson(line: LineString): GeoJsonLineString {
  return { type: 'LineString', coordinates: positionsOf(line) };
}

export function lineStringFromGeoJson(line: GeoJsonLineString): LineString {
  return create(LineStringSchema, columnsOf(line.coordinates));
}

export function pointToGeoJson({ x, y }: Point): GeoJsonPoint {
  return { type: 'Point', coordinates: [x, y] };
}

export function pointFromGeoJson({ coordinates: [x = NaN, y = NaN] }: GeoJsonPoint): Point {
  return create(PointSchema, { x, y });
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

/**
 * Converts an object to a feature. The id becomes a string, because ids have 64 bits. The geometry
 * is null if this version does not know the kind of the shape.
 */
export function objectToFeature(
  object: Object$,
  layer: string,
): Feature<ShapeGeometry | null, ObjectProperties> {
  return {
    type: 'Feature',
    id: object.id.toString(),
    geometry: object.shape ? shapeToGeoJson(object.shape) : null,
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

/** The coordinates of vertices in order, in columns. */
interface Columns {
  xs: number[];
  ys: number[];
}

function positionsOf({ xs, ys }: Columns): Position[] {
  return xs.map((x, i) => [x, ys[i] ?? NaN]);
}

function columnsOf(positions: readonly Position[]): Columns {
  return {
    xs: positions.map(([x = NaN]) => x),
    ys: positions.map(([, y = NaN]) => y),
  };
}

function closedPositions(ring: Ring): Position[] {
  const positions = positionsOf(ring);
  return positions[0] ? [...positions, [...positions[0]]] : positions;
}

function openRing(positions: Position[]): Ring {
  const [first, last] = [positions[0], positions.at(-1)];
  const isClosed = positions.length > 1 && first?.[0] === last?.[0] && first?.[1] === last?.[1];
  return create(RingSchema, columnsOf(isClosed ? positions.slice(0, -1) : positions));
}
