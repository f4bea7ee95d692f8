import { intersects, type Extent } from 'ol/extent';

/** The number of pixels along a side of a tile. */
const SIDE = 256;

export interface Tile {
  col: number;
  row: number;
  canvas: HTMLCanvasElement;
  /** Whether the tile must be painted again. */
  isDirty: boolean;
}

/**
 * The tiles of a picture of the plane at one resolution. Row 0 begins at y = 0, rows count upwards.
 */
export class TileSet {
  readonly #tiles = new Map<string, Tile>();

  /** `resolution` is in metres per CSS pixel. */
  constructor(readonly resolution: number) {}

  get #side(): number {
    return SIDE * this.resolution;
  }

  box({ col, row }: { col: number; row: number }): Extent {
    const side = this.#side;
    return [col * side, row * side, (col + 1) * side, (row + 1) * side];
  }

  /** Marks the tiles that touch a box or the `margin` pixels around it as dirty. */
  invalidate(box: Extent, margin: number): void {
    for (const { col, row } of this.#cellsIn(box, margin)) {
      const tile = this.#tiles.get(`${col},${row}`);
      if (tile) tile.isDirty = true;
    }
  }

  /** Returns all tiles that touch a box, and creates those that do not exist yet. */
  within(box: Extent): Tile[] {
    return [...this.#cellsIn(box, 0)].map(({ col, row }) => {
      const key = `${col},${row}`;
      let tile = this.#tiles.get(key);
      if (!tile) {
        const canvas = document.createElement('canvas');
        canvas.width = 0;
        tile = { col, row, canvas, isDirty: true };
        this.#tiles.set(key, tile);
      }
      return tile;
    });
  }

  /** Returns the tiles that touch a box and have been painted at least once. */
  paintedWithin(box: Extent): Tile[] {
    return [...this.#tiles.values()].filter(
      (tile) => tile.canvas.width > 0 && intersects(this.box(tile), box),
    );
  }

  /** Drops the tiles that do not touch a box. */
  trim(box: Extent): void {
    for (const [key, tile] of this.#tiles) {
      if (!intersects(this.box(tile), box)) this.#tiles.delete(key);
    }
  }

  /** Clears a tile, marks it as painted, and returns its context, whose unit is the metre. */
  begin(tile: Tile, pixelRatio: number): CanvasRenderingContext2D | null {
    const size = SIDE * pixelRatio;
    Object.assign(tile.canvas, { width: size, height: size });
    tile.isDirty = false;
    const context = tile.canvas.getContext('2d');
    const [minX = 0, , , maxY = 0] = this.box(tile);
    const scale = pixelRatio / this.resolution;
    context?.setTransform(scale, 0, 0, -scale, -minX * scale, maxY * scale);
    return context;
  }

  *#cellsIn(box: Extent, margin: number): Generator<{ col: number; row: number }> {
    const [minX = 0, minY = 0, maxX = 0, maxY = 0] = box;
    const far = margin * this.resolution;
    const [first, last] = [minX - far, maxX + far].map((x) => Math.floor(x / this.#side));
    const [lowest, highest] = [minY - far, maxY + far].map((y) => Math.floor(y / this.#side));
    for (let col = first ?? 0; col <= (last ?? -1); col++) {
      for (let row = lowest ?? 0; row <= (highest ?? -1); row++) yield { col, row };
    }
  }
}
