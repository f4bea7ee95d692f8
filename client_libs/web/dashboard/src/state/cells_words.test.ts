import { CellRunsSchema, create, LayerSchema } from '@hypermap/client';
import { expect, test } from 'vitest';
import { cellsWords } from './cells_words';

/** Makes runs with the given numbers of cells and values. */
const cells = (...runs: [value: number, count: number][]) =>
  create(CellRunsSchema, {
    rows: runs.map((_, row) => row),
    colBegins: runs.map(() => 0),
    colEnds: runs.map(([, count]) => count),
    values: runs.map(([value]) => value),
  });

test('occupancy and exploration are summarized by shares, largest first', () => {
  const floor = create(LayerSchema, {
    properties: { hasCells: true, words: ['free', 'occupied'] },
  });
  const parts = [cells([0.9, 2], [0.1, 5]), cells([NaN, 1], [0.05, 2])];
  expect(cellsWords(floor, parts)).toBe('70 % free, 20 % occupied, 10 % unknown');
  const seen = create(LayerSchema, {
    properties: { hasCells: true, isBinary: true, wordsOfValues: [{ word: 'explored', value: 1 }] },
  });
  expect(cellsWords(seen, [cells([1, 4])])).toBe('100 % explored');
  const unnamed = create(LayerSchema, { properties: { hasCells: true, isBinary: true } });
  expect(cellsWords(unnamed, [cells([1, 3], [0, 1])])).toBe('75 % 1, 25 % 0');
});

test('measurements are summarized by range and mean', () => {
  const wifi = create(LayerSchema, { properties: { hasCells: true, unit: 'dBm' } });
  expect(cellsWords(wifi, [cells([-70, 1], [-60, 3], [NaN, 9])])).toBe(
    '-70 to -60 dBm, mean -62.5 dBm',
  );
  expect(cellsWords(wifi, [cells([-70, 2])])).toBe('-70 dBm');
  expect(cellsWords(wifi, [cells([NaN, 2])])).toBe('unknown');
});
