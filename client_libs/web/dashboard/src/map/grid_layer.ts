import type { FrameState } from 'ol/Map';
import type { CellRange, GridStore } from '../state/grid_store';
import type { GridGeometry } from '../state/model';
import type { Look } from './look';
import { CanvasLayer } from './canvas_layer';
import { GridPalette, type Colouring } from './grid_palette';
import { GridRaster, levelFor } from './grid_raster';

/** The transform from (column, row) of a grid to canvas pixels. */
function pixelsFromCells(frame: FrameState, grid: GridGeometry): DOMMatrix {
  const { center, resolution } = frame.viewState;
  const [width = 0, height = 0] = frame.size;
  const scale = frame.pixelRatio / resolution;
  const { x = 0, y = 0, yaw = 0 } = grid.origin ?? {};
  return new DOMMatrix()
    .translate((width / 2) * frame.pixelRatio, (height / 2) * frame.pixelRatio)
    .scale(scale, -scale)
    .translate(x - (center[0] ?? 0), y - (center[1] ?? 0))
    .rotate((yaw * 180) / Math.PI)
    .scale(grid.resolutionM, grid.resolutionM);
}

function visibleCells(matrix: DOMMatrix, width: number, height: number): CellRange {
  const back = matrix.inverse();
  const corners = [
    [0, 0],
    [width, 0],
    [width, height],
    [0, height],
  ].map(([x, y]) => back.transformPoint({ x: x ?? 0, y: y ?? 0 }));
  const us = corners.map((p) => p.x);
  const vs = corners.map((p) => p.y);
  return { u0: Math.min(...us), u1: Math.max(...us), v0: Math.min(...vs), v1: Math.max(...vs) };
}

function covers(outer: CellRange, inner: CellRange): boolean {
  return (
    outer.u0 <= inner.u0 && outer.u1 >= inner.u1 && outer.v0 <= inner.v0 && outer.v1 >= inner.v1
  );
}

/** The intersection of two ranges, rounded outwards to whole pixels of a level. */
function clip(range: CellRange, limit: CellRange, level: number): CellRange {
  const step = 2 ** level;
  return {
    u0: Math.floor(Math.max(range.u0, limit.u0) / step) * step,
    u1: Math.ceil(Math.min(range.u1, limit.u1) / step) * step,
    v0: Math.floor(Math.max(range.v0, limit.v0) / step) * step,
    v1: Math.ceil(Math.min(range.v1, limit.v1) / step) * step,
  };
}

function widen(range: CellRange, part: number): CellRange {
  const du = (range.u1 - range.u0) * part;
  const dv = (range.v1 - range.v0) * part;
  return { u0: range.u0 - du, u1: range.u1 + du, v0: range.v0 - dv, v1: range.v1 + dv };
}

/** The cells that a picture shows and the level of its pixels. */
interface Picture {
  range: CellRange;
  level: number;
}

/**
 * Shows a grid store at any position and rotation. The visible tiles are assembled into one picture
 * somewhat larger than the view. Moving the map then draws a single image, and tiles show no seams.
 */
export class GridLayer extends CanvasLayer {
  readonly #picture = document.createElement('canvas');
  #pictured: Picture | undefined;
  readonly #raster: GridRaster;
  readonly #stop: () => void;
  #range = { min: NaN, max: NaN };

  constructor(
    private readonly store: GridStore,
    private readonly colouring: Colouring,
    private look: Look,
  ) {
    super();
    this.#raster = new GridRaster(store, this.#palette());
    this.#stop = store.onStep((dirty) => {
      this.#raster.forget(dirty);
      this.#recolour();
      this.#pictured = undefined;
      this.changed();
    });
  }

  setLook(look: Look): void {
    this.look = look;
    this.#raster.setPalette(this.#palette());
    this.#pictured = undefined;
    this.changed();
  }

  override disposeInternal(): void {
    this.#stop();
    super.disposeInternal();
  }

  protected override paint(context: CanvasRenderingContext2D, frame: FrameState): void {
    const { width, height } = context.canvas;
    const extent = this.#raster.extent();
    if (!this.store.geometry || !extent) return;
    const matrix = pixelsFromCells(frame, this.store.geometry);
    const pixelsPerCell = Math.hypot(matrix.a, matrix.b);
    const level = levelFor(pixelsPerCell);
    const visible = clip(visibleCells(matrix, width, height), extent, level);
    if (visible.u0 >= visible.u1 || visible.v0 >= visible.v1) return;
    const isMoving = frame.viewHints.some((count) => count > 0);
    const pictured = this.#pictureOf(visible, extent, level, isMoving);
    const step = 2 ** pictured.level;
    context.setTransform(matrix.translate(pictured.range.u0, pictured.range.v0).scale(step, step));
    context.imageSmoothingEnabled = pixelsPerCell * step < 2;
    context.drawImage(this.#picture, 0, 0);
  }

  // While the map is moving, a picture of another level is good enough.
  #pictureOf(visible: CellRange, extent: CellRange, level: number, isMoving: boolean): Picture {
    const last = this.#pictured;
    if (last && (isMoving || last.level === level) && covers(last.range, visible)) return last;
    const range = clip(widen(visible, 0.3), extent, level);
    this.#raster.draw(this.#picture, range, level);
    this.#pictured = { range, level };
    return this.#pictured;
  }

  #palette(): GridPalette {
    const { min, max } = this.store.range;
    this.#range = { min, max };
    const range = this.colouring.range ?? this.#range;
    return new GridPalette(this.colouring.ramp(this.look.dark), range.min, range.max);
  }

  // New measurements may extend the range that the colours are spread over.
  #recolour(): void {
    const { min, max } = this.store.range;
    if (this.colouring.range || (min === this.#range.min && max === this.#range.max)) return;
    this.#raster.setPalette(this.#palette());
  }
}
