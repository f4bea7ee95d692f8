import type { Object$ } from '../state/model';
import { classColour, css } from './colours';
import type { Look } from './look';
import type { Shape } from './shape_index';

/** The number of steps in which existence is shown, which limits the number of styles. */
const EXISTENCE_STEPS = 5;
/** Objects below this size have no outline, pixels before scaling for large screens. */
const SMALLEST_OUTLINED = 8;

interface Paint {
  fill: string;
  /** Empty for no outline. */
  outline: string;
}

/** Paints areas in the colours of their classes. The lower the existence, the fainter the area. */
export class AreaPainter {
  readonly #paints = new Map<string, Paint>();

  constructor(private readonly look: Look) {}

  /** Paints a shape. The context's unit is the metre; `resolution` is in metres per pixel. */
  paint(context: CanvasRenderingContext2D, shape: Shape, resolution: number): void {
    const [minX = 0, minY = 0, maxX = 0, maxY = 0] = shape.box;
    const isSmall =
      Math.max(maxX - minX, maxY - minY) < SMALLEST_OUTLINED * this.look.scale * resolution;
    const { fill, outline } = this.#paintOf(shape.object, isSmall);
    context.beginPath();
    for (const ring of shape.rings) {
      ring.forEach(([x, y], i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
      context.closePath();
    }
    context.fillStyle = fill;
    // The even-odd rule leaves holes empty whatever their winding is.
    context.fill('evenodd');
    if (!outline) return;
    context.strokeStyle = outline;
    context.lineWidth = 1.5 * this.look.scale * resolution;
    context.stroke();
  }

  #paintOf({ label, existence = 1 }: Object$, isSmall: boolean): Paint {
    const step = Math.round(existence * EXISTENCE_STEPS);
    const key = `${step}${isSmall}${label}`;
    let paint = this.#paints.get(key);
    if (!paint) {
      paint = paintOf(label, step / EXISTENCE_STEPS, isSmall, this.look.dark);
      this.#paints.set(key, paint);
    }
    return paint;
  }
}

function paintOf(label: string, existence: number, isSmall: boolean, dark: boolean): Paint {
  const colour = classColour(label, dark);
  // The area of an exploration covers most of the map, so it is not filled.
  if (label === 'exploration') return { fill: 'transparent', outline: css(colour, 0.8) };
  // Outlines take most of the painting time. A small area has none and a stronger fill instead.
  if (isSmall) return { fill: css(colour, 0.2 + 0.6 * existence), outline: '' };
  return {
    fill: css(colour, 0.15 + 0.5 * existence),
    outline: css(colour, 0.3 + 0.7 * existence),
  };
}
