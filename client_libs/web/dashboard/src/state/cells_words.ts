// Summarizes the values of many cells in one line.
import { runsOf } from '@hypermap/client';
import { contentOf } from './layer_content';
import type { CellRuns, Layer } from './model';
import { cellWords, occupancyWord, percent } from './words';

/** Calls `act` for each run of cells that share a value; NaN means unknown. */
function eachRun(cells: readonly CellRuns[], act: (value: number, count: number) => void): void {
  for (const runs of cells) {
    for (const { value, colBegin, colEnd } of runsOf(runs)) act(value, colEnd - colBegin);
  }
}

function wordOf(layer: Layer, value: number): string {
  if (Number.isNaN(value)) return 'unknown';
  const isFloor = contentOf(layer) === 'floor';
  return isFloor ? occupancyWord(layer, value) : cellWords(layer, value);
}

/** Formats the share of each value: "71 % free, 29 % occupied". */
function shares(layer: Layer, cells: readonly CellRuns[]): string {
  const counts = new Map<string, number>();
  let all = 0;
  eachRun(cells, (value, count) => {
    const word = wordOf(layer, value);
    counts.set(word, (counts.get(word) ?? 0) + count);
    all += count;
  });
  return Array.from(counts)
    .sort(([, a], [, b]) => b - a)
    .map(([word, count]) => `${percent(count / all)} ${word}`)
    .join(', ');
}

/** Formats the range and mean of the known cells: "-71 to -60 dBm, mean -64.2 dBm". */
function range(layer: Layer, cells: readonly CellRuns[]): string {
  let [low, high, sum, known] = [Infinity, -Infinity, 0, 0];
  eachRun(cells, (value, count) => {
    if (Number.isNaN(value)) return;
    low = Math.min(low, value);
    high = Math.max(high, value);
    sum += value * count;
    known += count;
  });
  if (known === 0) return 'unknown';
  if (low === high) return cellWords(layer, low);
  const lowest = Number(low.toPrecision(4));
  return `${lowest} to ${cellWords(layer, high)}, mean ${cellWords(layer, sum / known)}`;
}

export function cellsWords(layer: Layer, cells: readonly CellRuns[]): string {
  return contentOf(layer) === 'measurements' ? range(layer, cells) : shares(layer, cells);
}
