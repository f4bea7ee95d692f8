import { signal } from '@preact/signals';
import type { CellRuns, GridGeometry } from './model';

/** The number of cells along a side of a tile. */
export const TILE_SIDE = 256;

/** Tile rows and columns are below 2^23 in magnitude, because cell indices have 32 bits. */
const TILE_OFFSET = 2 ** 23;
const TILE_SPAN = 2 ** 24;

export type TileKey = number;

export function tileKey(row: number, col: number): TileKey {
  return (row + TILE_OFFSET) * TILE_SPAN + (col + TILE_OFFSET);
}

export function tileOf(key: TileKey): { row: number; col: number } {
  return { row: Math.floor(key / TILE_SPAN) - TILE_OFFSET, col: (key % TILE_SPAN) - TILE_OFFSET };
}

/** The cells with u0 <= column < u1 and v0 <= row < v1. */
export interface CellRange {
  u0: number;
  u1: number;
  v0: number;
  v1: number;
}

/** The cells of one grid layer in sparse tiles, which are allocated on the first write. */
export class GridStore {
  readonly type = 'grid';
  /** The geometry in the map's own frame. Undefined until cells are written. */
  geometry: GridGeometry | undefined;
  /** The values of each tile, row-major with the lowest row first; NaN means unknown. */
  readonly tiles = new Map<TileKey, Float32Array>();
  /** The range of all values that were ever written; empty when min > max. */
  readonly range = { min: Infinity, max: -Infinity };
  /** Counts the steps. Effects that read it run after each step. */
  readonly version = signal(0);

  #dirty = new Set<TileKey>();
  readonly #listeners = new Set<(dirty: ReadonlySet<TileKey>) => void>();

  write(runs: CellRuns): void {
    if (runs.grid) this.geometry = runs.grid;
    for (let i = 0; i < runs.rows.length; i++) {
      const value = runs.values[i] ?? NaN;
      this.#writeRun(runs.rows[i] ?? 0, runs.colBegins[i] ?? 0, runs.colEnds[i] ?? 0, value);
      if (value < this.range.min) this.range.min = value;
      if (value > this.range.max) this.range.max = value;
    }
  }

  valueAt(row: number, col: number): number {
    const tileRow = Math.floor(row / TILE_SIDE);
    const tileCol = Math.floor(col / TILE_SIDE);
    const tile = this.tiles.get(tileKey(tileRow, tileCol));
    return tile?.[(row - tileRow * TILE_SIDE) * TILE_SIDE + (col - tileCol * TILE_SIDE)] ?? NaN;
  }

  /** Returns the bounding box of all known cells. Linear in the number of cells. */
  knownBox(): CellRange | undefined {
    const box = { u0: Infinity, u1: -Infinity, v0: Infinity, v1: -Infinity };
    for (const [key, values] of this.tiles) {
      const { row, col } = tileOf(key);
      for (let i = 0; i < values.length; i++) {
        if (Number.isNaN(values[i])) continue;
        const u = col * TILE_SIDE + (i % TILE_SIDE);
        const v = row * TILE_SIDE + Math.floor(i / TILE_SIDE);
        if (u < box.u0) box.u0 = u;
        if (u >= box.u1) box.u1 = u + 1;
        if (v < box.v0) box.v0 = v;
        if (v >= box.v1) box.v1 = v + 1;
      }
    }
    return box.u0 < box.u1 ? box : undefined;
  }

  /** Notifies listeners of the tiles that were written since the last step. */
  step(): void {
    if (this.#dirty.size === 0) return;
    const dirty = this.#dirty;
    this.#dirty = new Set();
    this.version.value++;
    for (const listener of this.#listeners) listener(dirty);
  }

  onStep(listener: (dirty: ReadonlySet<TileKey>) => void): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  #writeRun(row: number, colBegin: number, colEnd: number, value: number): void {
    const tileRow = Math.floor(row / TILE_SIDE);
    const rowStart = (row - tileRow * TILE_SIDE) * TILE_SIDE;
    for (let col = colBegin; col < colEnd;) {
      const tileCol = Math.floor(col / TILE_SIDE);
      const firstCol = tileCol * TILE_SIDE;
      const end = Math.min(colEnd, firstCol + TILE_SIDE);
      const key = tileKey(tileRow, tileCol);
      this.#tile(key).fill(value, rowStart + col - firstCol, rowStart + end - firstCol);
      this.#dirty.add(key);
      col = end;
    }
  }

  #tile(key: TileKey): Float32Array {
    let tile = this.tiles.get(key);
    if (!tile) {
      tile = new Float32Array(TILE_SIDE * TILE_SIDE).fill(NaN);
      this.tiles.set(key, tile);
    }
    return tile;
  }
}
