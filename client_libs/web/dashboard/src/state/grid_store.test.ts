import { create, CellRunsSchema, GridGeometrySchema } from '@hypermap/client';
import { describe, expect, test } from 'vitest';
import { GridStore, TILE_SIDE, tileKey, tileOf } from './grid_store';

const grid = create(GridGeometrySchema, { origin: { x: 1, y: 2, yaw: 0.5 }, resolutionM: 0.05 });

function runs(...cells: [row: number, colBegin: number, colEnd: number, value: number][]) {
  return create(CellRunsSchema, {
    grid,
    rows: cells.map(([row]) => row),
    colBegins: cells.map(([, begin]) => begin),
    colEnds: cells.map(([, , end]) => end),
    values: cells.map(([, , , value]) => value),
  });
}

describe('tiles', () => {
  test.each([
    [0, 0],
    [-1, 5],
    [8388607, -8388608],
    [-8388608, 8388607],
  ])('of row %i and column %i have a key that converts back', (row, col) => {
    expect(tileOf(tileKey(row, col))).toEqual({ row, col });
  });
});

describe('a grid store', () => {
  test('returns the value that was written last, and NaN for all other cells', () => {
    const store = new GridStore();
    store.write(runs([3, 10, 20, 0.5], [3, 12, 14, 0.9]));
    const row = [9, 10, 11, 12, 13, 14, 19, 20].map((col) => store.valueAt(3, col));
    expect(row.map((value) => Number(value.toFixed(3)))).toEqual([
      NaN,
      0.5,
      0.5,
      0.9,
      0.9,
      0.5,
      0.5,
      NaN,
    ]);
    expect(store.valueAt(4, 10)).toBeNaN();
    expect(store.geometry).toBe(grid);
  });

  test('forgets cells that become unknown', () => {
    const store = new GridStore();
    store.write(runs([0, 0, 3, 1]));
    store.write(runs([0, 1, 2, NaN]));
    expect([0, 1, 2].map((col) => store.valueAt(0, col))).toEqual([1, NaN, 1]);
  });

  test('spreads a run over tiles, also left of and below the origin', () => {
    const store = new GridStore();
    store.write(runs([-1, -TILE_SIDE - 1, TILE_SIDE + 1, 1]));
    expect([...store.tiles.keys()].map(tileOf)).toEqual([
      { row: -1, col: -2 },
      { row: -1, col: -1 },
      { row: -1, col: 0 },
      { row: -1, col: 1 },
    ]);
    for (const col of [-TILE_SIDE - 1, -1, 0, TILE_SIDE]) expect(store.valueAt(-1, col)).toBe(1);
    for (const col of [-TILE_SIDE - 2, TILE_SIDE + 1]) expect(store.valueAt(-1, col)).toBeNaN();
  });

  test('notifies listeners only of the tiles that were written since the last step', () => {
    const store = new GridStore();
    store.write(runs([0, 0, 1, 1]));
    store.step();
    const told: number[][] = [];
    store.onStep((dirty) => told.push([...dirty]));
    store.write(runs([0, 5, 6, 1], [TILE_SIDE, 0, 1, 1]));
    store.step();
    store.step();
    expect(told).toEqual([[tileKey(0, 0), tileKey(1, 0)]]);
  });

  test('knows the range of its values', () => {
    const store = new GridStore();
    store.write(runs([0, 0, 1, -70], [0, 1, 2, NaN], [0, 2, 3, -30]));
    expect(store.range).toEqual({ min: -70, max: -30 });
  });

  test('knows the bounding box of the known cells', () => {
    const store = new GridStore();
    expect(store.knownBox()).toBeUndefined();
    store.write(runs([-3, -300, -290, 1], [500, 7, 8, 0], [900, 0, 9, NaN]));
    expect(store.knownBox()).toEqual({ u0: -300, u1: 8, v0: -3, v1: 501 });
  });
});
