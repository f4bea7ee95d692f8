import { create, shapeFromGeoJson, ShapeSchema, type ShapeGeometry } from '@hypermap/client';
import { expect, test } from 'vitest';
import { geometryOf, shapeOf } from './geometry';

test.each<ShapeGeometry>([
  {
    type: 'Polygon',
    coordinates: [
      [
        [0, 0],
        [4, 0],
        [4, 3],
        [0, 0],
      ],
    ],
  },
  {
    type: 'LineString',
    coordinates: [
      [0, 0],
      [4, 1],
    ],
  },
  { type: 'Point', coordinates: [3, -2.5] },
])('a shape is converted in both directions: %j', (geometry) => {
  const shape = shapeFromGeoJson(geometry);
  const converted = geometryOf(shape);
  expect(converted?.getType()).toBe(geometry.type);
  expect(converted && shapeOf(converted)).toEqual(shape);
});

test('a shape of an unknown kind has no geometry', () => {
  expect(geometryOf(create(ShapeSchema))).toBeUndefined();
  expect(geometryOf(undefined)).toBeUndefined();
});
