import {
  create,
  LayerSchema,
  ObjectSchema,
  shapeFromGeoJson,
  type ShapeGeometry,
} from '@hypermap/client';
import { expect, test } from 'vitest';
import { squareAround } from './objects';
import { ago, authorWords, cellWords, percent, shapeWords, squareMetres } from './words';

test('cell values are formatted with the words of their layer', () => {
  const properties = { hasCells: true, words: ['free', 'occupied', 'unknown'] };
  const floor = create(LayerSchema, { properties });
  expect(cellWords(floor, 0.02)).toBe('free (2 %)');
  expect(cellWords(floor, 0.5)).toBe('undecided (50 %)');
  expect(cellWords(floor, 0.97)).toBe('occupied (97 %)');
  const careful = create(LayerSchema, {
    properties,
    thresholds: { freeBelow: 0.01, occupiedAbove: 0.4 },
  });
  expect(cellWords(careful, 0.5)).toBe('occupied (50 %)');
  const wordsOfValues = [
    { word: 'allowed', value: -1 },
    { word: 'forbidden', value: 1 },
  ];
  const binary = create(LayerSchema, {
    properties: { hasCells: true, isBinary: true, wordsOfValues },
  });
  expect([-1, 1, 0].map((value) => cellWords(binary, value))).toEqual([
    'allowed',
    'forbidden',
    '0',
  ]);
  const wifi = create(LayerSchema, { properties: { hasCells: true, unit: 'dBm' } });
  expect(cellWords(wifi, -61.23456)).toBe('-61.23 dBm');
});

test('shapes are described by their kind and size', () => {
  const words = (geometry: ShapeGeometry) =>
    shapeWords(create(ObjectSchema, { shape: shapeFromGeoJson(geometry) }));
  const square = squareAround([0, 0], 2);
  expect(words({ type: 'Polygon', coordinates: [square] })).toBe('polygon, 4.00 m²');
  expect(words({ type: 'LineString', coordinates: square })).toBe('line, 8.00 m');
  expect(words({ type: 'Point', coordinates: [1, 2] })).toBe('point');
  expect(shapeWords(create(ObjectSchema))).toBe('');
});

test('only exact 0 and 1 are formatted as 0 % and 100 %', () => {
  expect([0, 0.001, 0.5, 0.999, 1].map(percent)).toEqual([
    '0 %',
    '< 1 %',
    '50 %',
    '> 99 %',
    '100 %',
  ]);
});

test('times are formatted relative to now', () => {
  const now = new Date('2026-01-02T12:00:00Z');
  const before = (seconds: number) => ago(new Date(now.getTime() - seconds * 1000), now);
  expect([-5, 30, 90, 7300].map(before)).toEqual(['just now', 'just now', '1 min ago', '2 h ago']);
  expect(before(200_000)).toMatch(/^on /);
});

test('authors are formatted as their address or name', () => {
  const authors = ['ipv4:10.0.0.7:58258', 'ipv6:[::1]:4711', 'expiry', 'alice'];
  expect(authors.map(authorWords)).toEqual(['10.0.0.7', '[::1]', 'expiry', 'alice']);
});

test('the larger an area, the fewer digits', () => {
  expect([0.357, 19.74, 3300].map(squareMetres)).toEqual(['0.36 m²', '19.7 m²', '3,300 m²']);
});
