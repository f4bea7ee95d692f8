import { LayerKind } from '../state/model';
import { SCALAR_RAMP, colourAt, explorationRamp, occupancyRamp, type Ramp } from './colours';

const STEPS = 256;

export function rampOf(kind: LayerKind, dark: boolean): Ramp {
  if (kind === LayerKind.SCALAR) return SCALAR_RAMP;
  return kind === LayerKind.EXPLORATION ? explorationRamp(dark) : occupancyRamp(dark);
}

/** How the values of a grid are coloured. */
export interface Colouring {
  ramp: (dark: boolean) => Ramp;
  /** The values at the ends of the ramp. Absent: the range of the values in the grid. */
  range?: { min: number; max: number };
}

export function colouringOf(kind: LayerKind): Colouring {
  const ramp = (dark: boolean): Ramp => rampOf(kind, dark);
  return kind === LayerKind.SCALAR ? { ramp } : { ramp, range: { min: 0, max: 1 } };
}

/** A lookup table from the values of a grid to colours. */
export class GridPalette {
  /** Pixels as in ImageData, for equal steps of the range; the last one is for unknown cells. */
  readonly #pixels = new Uint32Array(STEPS + 1);

  constructor(
    ramp: Ramp,
    private readonly min: number,
    private readonly max: number,
  ) {
    const bytes = new Uint8ClampedArray(this.#pixels.buffer);
    for (let i = 0; i < STEPS; i++) bytes.set(colourAt(ramp, i / (STEPS - 1)), 4 * i);
  }

  /** Writes the colour of values[i] to pixels[i]. */
  paint(values: Float32Array, pixels: Uint32Array): void {
    const scale = this.max > this.min ? (STEPS - 1) / (this.max - this.min) : 0;
    for (let i = 0; i < values.length; i++) {
      const value = values[i] ?? NaN;
      const step = Math.round((value - this.min) * scale);
      const index = Number.isNaN(value) ? STEPS : Math.min(STEPS - 1, Math.max(0, step));
      pixels[i] = this.#pixels[index] ?? 0;
    }
  }
}
