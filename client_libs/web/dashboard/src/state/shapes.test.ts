import { create, ObjectSchema, shapeFromGeoJson, type ShapeGeometry } from '@hypermap/client';
import { describe, expect, test } from 'vitest';
import type { Object$, Position } from './model';
import { squareAround } from './objects';
import { areaOf, boxOf, isHit, kindOf, lengthOf, objectsAt } from './shapes';

const object = (label: string, geometry: ShapeGeometry): Object$ =>
  create(ObjectSchema, { label, shape: shapeFromGeoJson(geometry) });

const polygon = (label: string, ...rings: Position[][]) =>
  object(label, { type: 'Polygon', coordinates: rings });
const line = (label: string, ...coordinates: Position[]) =>
  object(label, { type: 'LineString', coordinates });
const point = (label: string, ...coordinates: Position) =>
  object(label, { type: 'Point', coordinates });

const square = (label: string, at: Position, side: number) =>
  polygon(label, squareAround(at, side));
const shapeless = create(ObjectSchema, { label: 'nothing' });

describe('measures', () => {
  const court = polygon('court', squareAround([0, 0], 4), squareAround([0, 0], 1));
  const lane = line('lane', [1, 5], [4, 1], [4, -1]);
  const dock = point('dock', 3, 2);

  test('the area of a polygon excludes its holes, other shapes have none', () => {
    expect([court, lane, dock, shapeless].map(areaOf)).toEqual([15, 0, 0, 0]);
  });

  test('a line has a length', () => {
    expect([court, lane, dock, shapeless].map(lengthOf)).toEqual([0, 7, 0, 0]);
  });

  test('every shape has a box and a kind', () => {
    const all = [court, lane, dock, shapeless];
    expect(all.map(boxOf)).toEqual([[-2, -2, 2, 2], [1, -1, 4, 5], [3, 2, 3, 2], undefined]);
    expect(all.map(kindOf)).toEqual(['polygon', 'lineString', 'point', undefined]);
  });
});

describe('a pointer', () => {
  const court = polygon('court', squareAround([0, 0], 4), squareAround([0, 0], 2));

  test.each<[string, Position, boolean]>([
    ['inside', [1.5, 0.3], true],
    ['in the hole', [0.2, 0.1], false],
    ['outside', [2.1, 0], false],
    ['on the boundary', [2, 0.7], true],
    ['on the boundary of the hole', [0.4, 1], true],
    ['on a corner', [-2, -2], true],
    ['beside a corner, at its height', [3, 2], false],
  ])('%s of a polygon', (_, at, expected) => {
    expect(isHit(court, at, 0.2)).toBe(expected);
  });

  test('hits lines and points that it reaches', () => {
    const lane = line('lane', [0, 0], [10, 0], [10, 10]);
    expect(isHit(lane, [5, 0.2], 0.25)).toBe(true);
    expect(isHit(lane, [5, 0.3], 0.25)).toBe(false);
    expect(isHit(lane, [10.2, 10.2], 0.25)).toBe(false);
    expect(isHit(lane, [10.1, 10.2], 0.25)).toBe(true);
    const dock = point('dock', 1, 1);
    expect(isHit(dock, [1.1, 1.2], 0.25)).toBe(true);
    expect(isHit(dock, [1.2, 1.2], 0.25)).toBe(false);
    expect(isHit(shapeless, [0, 0], 9)).toBe(false);
  });

  test('means the point, the nearest line and the smallest polygon first', () => {
    const all = [
      square('room', [0, 0], 10),
      line('wall', [-5, 0.4], [5, 0.4]),
      square('table', [0, 0], 2),
      line('lane', [-5, 0.1], [5, 0.1]),
      point('dock', 0.3, 0.3),
      square('far', [5, 5], 1),
      point('elsewhere', 3, 3),
    ];
    const meant = (at: Position) => objectsAt(all, at, 0.5).map(({ label }) => label);
    expect(meant([0, 0])).toEqual(['dock', 'lane', 'wall', 'table', 'room']);
    expect(meant([0, -0.9])).toEqual(['table', 'room']);
    expect(meant([-4, 0.5])).toEqual(['wall', 'lane', 'room']);
  });
});
