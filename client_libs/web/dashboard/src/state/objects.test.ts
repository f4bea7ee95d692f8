import { create, LayerSchema, polygonToGeoJson, shapeToGeoJson, ShapeKind } from '@hypermap/client';
import { beforeEach, expect, test } from 'vitest';
import {
  drawableLayers,
  drawnObject,
  kindsTakenBy,
  polygonOf,
  smallShapeAt,
  squareAround,
} from './objects';
import { KINDS_OF_SHAPE, kindOf } from './shapes';
import { layers } from './site';

beforeEach(() => {
  const layer = (name: string, size: bigint, ...shapeKinds: ShapeKind[]) =>
    create(LayerSchema, { name, size, shapeKinds, properties: { hasShapes: true } });
  layers.value = [
    create(LayerSchema, { name: 'floor', properties: { hasCells: true } }),
    layer('explorations', 9n),
    layer('objects', 1n),
    layer('ways', 2n, ShapeKind.POINT, ShapeKind.LINE_STRING),
  ];
});

test('users draw on the layers with shapes, but not on the explorations of the server', () => {
  expect(drawableLayers.value).toEqual(['ways', 'objects']);
});

test('a layer takes the kinds of shape that it names, or all', () => {
  expect(kindsTakenBy('ways')).toEqual(['lineString', 'point']);
  expect(kindsTakenBy('objects')).toEqual(['polygon', 'lineString', 'point']);
});

test('keeps the corners that were drawn, once each', () => {
  const outer = squareAround([10, 5], 2);
  const polygon = polygonOf([outer]);
  expect(polygon.outer).toMatchObject({ xs: [9, 11, 11, 9], ys: [4, 4, 6, 6] });
  expect(polygonToGeoJson(polygon).coordinates).toEqual([outer]);
});

test.each(KINDS_OF_SHAPE)('places a small %s around a position', (kind) => {
  const object = drawnObject('thing', smallShapeAt([3, 2], kind));
  expect(object).toMatchObject({ id: 0n, label: 'thing', existence: 1 });
  expect(kindOf(object)).toBe(kind);
  const { coordinates } = (object.shape && shapeToGeoJson(object.shape)) ?? {};
  const flat = coordinates?.flat(2) ?? [];
  expect(Math.min(...flat.filter((_, i) => i % 2 === 0))).toBeGreaterThan(2);
  expect(Math.max(...flat.filter((_, i) => i % 2 === 0))).toBeLessThan(4);
});
