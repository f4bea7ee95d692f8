import { PNG } from 'pngjs';

/** A position on the screen, pixels from its upper left corner. */
export interface Pixel {
  x: number;
  y: number;
}

/** Red, green and blue in 0..255. */
export type Colour = readonly [number, number, number];

/** The colours of a screenshot. */
export class Picture {
  readonly #png: PNG;

  constructor(png: Buffer) {
    this.#png = PNG.sync.read(png);
  }

  /** Returns the colour of the pixel at a position. Fails outside of the picture. */
  colourAt({ x, y }: Pixel): Colour {
    const { width, height, data } = this.#png;
    const [column, row] = [Math.floor(x), Math.floor(y)];
    if (column < 0 || column >= width || row < 0 || row >= height) {
      throw new RangeError(`the picture has no pixel at ${x}, ${y}`);
    }
    const [red = 0, green = 0, blue = 0] = data.subarray(4 * (row * width + column));
    return [red, green, blue];
  }

  /** Whether the pixel at a position has a colour, except for small differences. */
  has(colour: Colour, at: Pixel, tolerance = 8): boolean {
    return this.colourAt(at).every((part, i) => Math.abs(part - (colour[i] ?? 0)) <= tolerance);
  }
}
