import type { Object$ } from '../state/model';
import { classColour, css } from './colours';
import type { Look } from './look';
import type { Shape } from './shape_index';

/** Existence is shown in so many steps. */
const EXISTENCE_STEPS = 5;
/** Objects that look smaller have no outline, pixels; more on larger screens. */
const SMALLEST_OUTLINED = 8;

interface Paint {
  fill: string;
  /** Empty: none. */
  outline: string;
}

/** Paints areas by class; the less sure it is that an object is there, the fainter it is. */
export class AreaPainter {
  readonly #paints = new Map<string, Paint>();

  constructor(private readonly look: Look) {}

  /** The context takes metres; `resolution` is in metres a pixel. */
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
    // Holes wind the other way, which the even-odd rule need not know.
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
  // An area that is explored frames the map, it does not hide it.
  if (label === 'exploration') return { fill: 'transparent', outline: css(colour, 0.8) };
  // Outlines cost most of the time. Without one, the area is as strong as both together.
  if (isSmall) return { fill: css(colour, 0.2 + 0.6 * existence), outline: '' };
  return {
    fill: css(colour, 0.15 + 0.5 * existence),
    outline: css(colour, 0.3 + 0.7 * existence),
  };
}
