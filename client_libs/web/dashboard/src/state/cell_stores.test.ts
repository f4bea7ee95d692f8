import { CellRunsSchema, create } from '@hypermap/client';
import { expect, test } from 'vitest';
import { cellStores } from './cell_stores';

const runs = (resolutionM: number, row: number, value: number) =>
  create(CellRunsSchema, {
    grid: { origin: { x: 0, y: 0, yaw: 0 }, resolutionM },
    rows: [row],
    colBegins: [0],
    colEnds: [2],
    values: [value],
  });

test('cells of the same grid share a store, whatever their values are', () => {
  const stores = cellStores([runs(0.05, 0, 0.9), runs(0.1, 0, 1), runs(0.05, 1, NaN)]);
  expect(stores.map(({ geometry }) => geometry?.resolutionM)).toEqual([0.05, 0.1]);
  const [fine, coarse] = stores;
  expect([0, 1, 2].map((row) => fine?.valueAt(row, 1))).toEqual([1, 1, NaN]);
  expect([0, 1].map((row) => coarse?.valueAt(row, 0))).toEqual([1, NaN]);
});
