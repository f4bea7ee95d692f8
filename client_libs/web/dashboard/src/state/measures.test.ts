import { create, CellRunsSchema } from '@hypermap/client';
import { expect, test } from 'vitest';
import { boxAround, measureCells, ringArea } from './measures';
import type { Position } from './model';

const square = (x: number, y: number, side: number): Position[] => [
  [x, y],
  [x + side, y],
  [x + side, y + side],
  [x, y + side],
];

test('the area of a ring does not depend on winding and closing', () => {
  const ring = square(10, -5, 3);
  const [first] = ring;
  expect(ringArea(ring)).toBe(9);
  expect(ringArea(ring.toReversed())).toBe(9);
  expect(ringArea(first ? [...ring, first] : [])).toBe(9);
  expect(ringArea([])).toBe(0);
});

test('cells are counted and measured over all parts', () => {
  const grid = { origin: { x: 1, y: 2, yaw: 0 }, resolutionM: 0.5 };
  const part = (row: number, begin: number, end: number) =>
    create(CellRunsSchema, { grid, rows: [row], colBegins: [begin], colEnds: [end], values: [1] });
  expect(measureCells([part(0, -2, 4), part(3, 0, 1)])).toEqual({
    count: 7,
    areaM2: 1.75,
    box: [0, 2, 3, 4],
  });
  expect(measureCells([])).toEqual({ count: 0, areaM2: 0, box: undefined });
});

test('a box contains its positions', () => {
  expect(
    boxAround([
      [1, 5],
      [-2, 7],
    ]),
  ).toEqual([-2, 5, 1, 7]);
  expect(boxAround([])).toBeUndefined();
});
