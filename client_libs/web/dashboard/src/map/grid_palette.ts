import { binaryValues, contentOf, valueRange, type Range } from '../state/layer_content';
import type { Layer } from '../state/model';
import { MEASUREMENTS_RAMP, binaryRamp, colourAt, floorRamp, type Ramp } from './colours';

const STEPS = 256;

/** The colours of the cells of a layer, from its lowest value to its highest. */
export function rampOf(layer: Layer, dark: boolean): Ramp {
  switch (contentOf(layer)) {
    case 'floor':
      return floorRamp(dark);
    case 'binary':
      return binaryRamp(dark);
    default:
      return MEASUREMENTS_RAMP;
  }
}

/** The parameters that determine the colours of the cells of a grid. */
export interface Colouring {
  ramp: (dark: boolean) => Ramp;
  /** The values at the ends of the ramp. Absent: the range of the values in the grid. */
  range?: Range | undefined;
}

export function colouringOf(layer: Layer): Colouring {
  const range = contentOf(layer) === 'binary' ? binaryValues(layer) : valueRange(layer);
  return { ramp: (dark) => rampOf(layer, dark), range };
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
