import { mkdirSync, writeFileSync } from 'node:fs';

import { buildFolder } from './places.js';

/** Prints measured figures and saves them as build/e2e/figures/NAME.txt. */
export function printFigures(name: string, text: string): void {
  const folder = `${buildFolder}/e2e/figures`;
  mkdirSync(folder, { recursive: true });
  writeFileSync(`${folder}/${name}.txt`, `${text}\n`);
  console.log(text);
}

/** The smallest value that at least the given share of all values does not exceed. */
export function quantile(values: readonly number[], share: number): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.max(0, Math.ceil(share * sorted.length) - 1)] ?? NaN;
}
