import { shapeFromGeoJson, shapeToGeoJson, type ShapeGeometry } from '@hypermap/client';
import LineString from 'ol/geom/LineString';
import Point from 'ol/geom/Point';
import Polygon from 'ol/geom/Polygon';
import type { Shape } from '../state/model';

/** A shape as OpenLayers draws and edits it. */
export type Geometry = Polygon | LineString | Point;

/** Converts a shape. Undefined if the dashboard does not know its kind. */
export function geometryOf(shape: Shape | undefined): Geometry | undefined {
  const geometry = shape && shapeToGeoJson(shape);
  switch (geometry?.type) {
    case 'Polygon':
      return new Polygon(geometry.coordinates);
    case 'LineString':
      return new LineString(geometry.coordinates);
    case 'Point':
      return new Point(geometry.coordinates);
    default:
      return undefined;
  }
}

export function shapeOf(geometry: Geometry): Shape {
  const [type, coordinates] = [geometry.getType(), geometry.getCoordinates()];
  return shapeFromGeoJson({ type, coordinates } as ShapeGeometry);
}
