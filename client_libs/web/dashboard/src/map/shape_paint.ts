import type { Object$, Polygon } from '../state/model';
import { ringsOf } from '../state/shapes';
import { classColour, css } from './colours';
import type { Look } from './look';
import type { Placed } from './shape_index';

/** The number of steps in which existence is shown, which limits the number of styles. */
const EXISTENCE_STEPS = 5;
/** Polygons below this size have no outline, pixels before scaling for large screens. */
const SMALLEST_OUTLINED = 8;

// Widths and radii in pixels before scaling for large screens.
const OUTLINE = 1.5;
const LINE = 3;
export const POINT_RADIUS = 5;
/** The width of the ring around a point, which sets it off from what it lies on. */
const HALO = 2;

/** The distance by which paint exceeds the bounding boxes of objects, pixels. */
export function reachOfPaint({ scale }: Look): number {
  return Math.ceil((POINT_RADIUS + HALO) * scale) + 1;
}

interface Paint {
  fill: string;
  /** The colour of outlines, lines and points. Empty for no outline. */
  stroke: string;
}

/** Appends the vertices of a ring or a line to the path of the context. */
function trace(
  context: CanvasRenderingContext2D,
  { xs, ys }: { xs: readonly number[]; ys: readonly number[] },
): void {
  for (let i = 0; i < xs.length; i++) {
    const [x, y] = [xs[i] ?? 0, ys[i] ?? 0];
    if (i === 0) context.moveTo(x, y);
    else context.lineTo(x, y);
  }
}

/**
 * Paints polygons, lines and points in the colours of their classes. The lower the existence, the
 * fainter the object.
 */
export class ShapePainter {
  readonly #paints = new Map<string, Paint>();

  constructor(private readonly look: Look) {}

  /** Paints an object. The context's unit is the metre; `resolution` is in metres per pixel. */
  paint(context: CanvasRenderingContext2D, { object, box }: Placed, resolution: number): void {
    const { shape } = object.shape ?? {};
    const pixel = this.look.scale * resolution;
    context.beginPath();
    switch (shape?.case) {
      case 'polygon':
        this.#paintPolygon(context, shape.value, this.#paintOf(object, isSmall(box, pixel)), pixel);
        break;
      case 'lineString':
        trace(context, shape.value);
        context.lineCap = 'round';
        context.lineJoin = 'round';
        context.lineWidth = LINE * pixel;
        context.strokeStyle = this.#paintOf(object, false).stroke;
        context.stroke();
        break;
      case 'point':
        context.arc(
          shape.value.x,
          shape.value.y,
          (POINT_RADIUS + HALO / 2) * pixel,
          0,
          2 * Math.PI,
        );
        context.lineWidth = HALO * pixel;
        context.strokeStyle = this.look.dark ? 'rgba(15,18,23,.85)' : 'rgba(255,255,255,.9)';
        context.stroke();
        context.beginPath();
        context.arc(shape.value.x, shape.value.y, POINT_RADIUS * pixel, 0, 2 * Math.PI);
        context.fillStyle = this.#paintOf(object, false).stroke;
        context.fill();
        break;
    }
  }

  #paintPolygon(
    context: CanvasRenderingContext2D,
    polygon: Polygon,
    { fill, stroke }: Paint,
    pixel: number,
  ): void {
    for (const ring of ringsOf(polygon)) {
      trace(context, ring);
      context.closePath();
    }
    context.fillStyle = fill;
    // The even-odd rule leaves holes empty whatever their winding is.
    context.fill('evenodd');
    if (!stroke) return;
    context.lineJoin = 'miter';
    context.strokeStyle = stroke;
    context.lineWidth = OUTLINE * pixel;
    context.stroke();
  }

  #paintOf({ label, existence = 1 }: Object$, small: boolean): Paint {
    const step = Math.round(existence * EXISTENCE_STEPS);
    const key = `${step}${small}${label}`;
    let paint = this.#paints.get(key);
    if (!paint) {
      paint = paintOf(label, step / EXISTENCE_STEPS, small, this.look.dark);
      this.#paints.set(key, paint);
    }
    return paint;
  }
}

function isSmall([minX = 0, minY = 0, maxX = 0, maxY = 0]: Placed['box'], pixel: number): boolean {
  return Math.max(maxX - minX, maxY - minY) < SMALLEST_OUTLINED * pixel;
}

function paintOf(label: string, existence: number, small: boolean, dark: boolean): Paint {
  const colour = classColour(label, dark);
  // The area of an exploration covers most of the map, so it is not filled.
  if (label === 'exploration') return { fill: 'transparent', stroke: css(colour, 0.8) };
  // Outlines take most of the painting time. A small polygon has none and a stronger fill instead.
  if (small) return { fill: css(colour, 0.2 + 0.6 * existence), stroke: '' };
  return {
    fill: css(colour, 0.15 + 0.5 * existence),
    stroke: css(colour, 0.3 + 0.7 * existence),
  };
}
