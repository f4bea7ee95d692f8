import {
  TILE_SIDE,
  tileOf,
  type CellRange,
  type GridStore,
  type TileKey,
} from '../state/grid_store';
import type { GridPalette } from './grid_palette';

/** The coarsest level, at which a tile has 4 x 4 pixels. */
const MAX_LEVEL = 6;

/** The coarsest level whose pixels are not larger than those of the screen. */
export function levelFor(pixelsPerCell: number): number {
  return Math.min(MAX_LEVEL, Math.max(0, Math.floor(Math.log2(1 / pixelsPerCell))));
}

function canvasOf(width: number, height: number): HTMLCanvasElement {
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  return canvas;
}

function contextOf(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
  const context = canvas.getContext('2d');
  if (!context) throw new Error('no 2d canvas');
  return context;
}

/**
 * The cells of a grid as pixels. Changed tiles are painted when they are next drawn, and halved for
 * coarser levels. Row 0 is on top, so callers draw the picture upside down.
 */
export class GridRaster {
  /** The levels of each tile: level 0 has a pixel per cell, level 1 half as many per side, ... */
  readonly #levels = new Map<TileKey, HTMLCanvasElement[]>();

  constructor(
    private readonly store: GridStore,
    private palette: GridPalette,
  ) {}

  setPalette(palette: GridPalette): void {
    this.palette = palette;
    this.#levels.clear();
  }

  /** Drops the pixels of tiles whose cells have changed. */
  forget(tiles: Iterable<TileKey>): void {
    for (const key of tiles) this.#levels.delete(key);
  }

  /** The bounding box of all tiles. Undefined if there are none. */
  extent(): CellRange | undefined {
    const range = { u0: Infinity, u1: -Infinity, v0: Infinity, v1: -Infinity };
    for (const key of this.store.tiles.keys()) {
      const { row, col } = tileOf(key);
      range.u0 = Math.min(range.u0, col * TILE_SIDE);
      range.u1 = Math.max(range.u1, (col + 1) * TILE_SIDE);
      range.v0 = Math.min(range.v0, row * TILE_SIDE);
      range.v1 = Math.max(range.v1, (row + 1) * TILE_SIDE);
    }
    return this.store.tiles.size > 0 ? range : undefined;
  }

  /** Draws a range, whose bounds are multiples of 2^level, to the upper left of a canvas. */
  draw(target: HTMLCanvasElement, range: CellRange, level: number): void {
    const scale = 2 ** level;
    const side = TILE_SIDE / scale;
    target.width = (range.u1 - range.u0) / scale;
    target.height = (range.v1 - range.v0) / scale;
    const context = contextOf(target);
    for (const key of this.store.tiles.keys()) {
      const { row, col } = tileOf(key);
      const x = (col * TILE_SIDE - range.u0) / scale;
      const y = (row * TILE_SIDE - range.v0) / scale;
      if (x + side <= 0 || y + side <= 0 || x >= target.width || y >= target.height) continue;
      context.drawImage(this.#tile(key, level), x, y);
    }
  }

  #tile(key: TileKey, level: number): HTMLCanvasElement {
    let levels = this.#levels.get(key);
    if (!levels) {
      levels = [this.#paint(key)];
      this.#levels.set(key, levels);
    }
    for (let i = levels.length; i <= level; i++) {
      const side = TILE_SIDE >> i;
      const half = canvasOf(side, side);
      const source = levels[i - 1];
      if (source) contextOf(half).drawImage(source, 0, 0, side, side);
      levels.push(half);
    }
    return levels[level] ?? canvasOf(1, 1);
  }

  #paint(key: TileKey): HTMLCanvasElement {
    const canvas = canvasOf(TILE_SIDE, TILE_SIDE);
    const values = this.store.tiles.get(key);
    if (!values) return canvas;
    const image = new ImageData(TILE_SIDE, TILE_SIDE);
    this.palette.paint(values, new Uint32Array(image.data.buffer));
    contextOf(canvas).putImageData(image, 0, 0);
    return canvas;
  }
}
