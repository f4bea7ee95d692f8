import { buffer, getHeight, getWidth, type Extent } from 'ol/extent';
import type { FrameState } from 'ol/Map';
import type { Object$, Position } from '../state/model';
import type { ObjectDelta, ObjectStore } from '../state/object_store';
import { CanvasLayer } from './canvas_layer';
import type { Look } from './look';
import { ShapeIndex } from './shape_index';
import { reachOfPaint, ShapePainter } from './shape_paint';
import { TileSet, type Tile } from './tile_set';

/**
 * The number of objects after which the rest is painted in the following frames. It measures the
 * work better than the clock does, because browsers defer painting to the end of the frame.
 */
const OBJECTS_A_FRAME = 800;

/** Converts a square box in metres to canvas pixels: its upper left corner and its side. */
function placeOf(frame: FrameState, box: Extent): [x: number, y: number, side: number] {
  const { center, resolution } = frame.viewState;
  const [width = 0, height = 0] = frame.size;
  const [minX = 0, , maxX = 0, maxY = 0] = box;
  const scale = frame.pixelRatio / resolution;
  const x = (minX - (center[0] ?? 0)) * scale + (width / 2) * frame.pixelRatio;
  const y = ((center[1] ?? 0) - maxY) * scale + (height / 2) * frame.pixelRatio;
  return [x, y, (maxX - minX) * scale];
}

/**
 * Shows the shapes of many objects. They are painted into tiles, a limited number per frame so that
 * the map moves smoothly, and a change repaints only the tiles that it touches. While the map is
 * being zoomed, the tiles are stretched; they are painted at the new resolution when the map is at
 * rest.
 */
export class ShapeLayer extends CanvasLayer {
  readonly #shapes: ShapeIndex;
  #painter: ShapePainter;
  /** The distance by which paint exceeds the bounding boxes of objects, pixels. */
  #margin: number;
  #tiles = new TileSet(1);
  /** The tiles of the previous resolution, shown where a new tile is not painted yet. */
  #before: TileSet | undefined;

  constructor(store: ObjectStore, look: Look) {
    super();
    this.#shapes = new ShapeIndex(store.objects.values());
    this.#painter = new ShapePainter(look);
    this.#margin = reachOfPaint(look);
  }

  setLook(look: Look): void {
    this.#painter = new ShapePainter(look);
    this.#margin = reachOfPaint(look);
    this.#tiles = new TileSet(this.#tiles.resolution);
    this.#before = undefined;
    this.changed();
  }

  update({ put, removed }: ObjectDelta): void {
    const boxes: Extent[] = [];
    for (const id of removed) boxes.push(...this.#shapes.remove(id));
    for (const object of put.values()) boxes.push(...this.#shapes.put(object));
    for (const box of boxes) {
      this.#tiles.invalidate(box, this.#margin);
      this.#before?.invalidate(box, this.#margin);
    }
    this.changed();
  }

  /** Returns the objects whose boxes are at most a distance away from a position. */
  near(at: Position, distanceM: number): Object$[] {
    return this.#shapes.near(at, distanceM);
  }

  protected override paint(context: CanvasRenderingContext2D, frame: FrameState): void {
    const box = frame.extent;
    if (!box) return;
    const { resolution } = frame.viewState;
    const isMoving = frame.viewHints.some((count) => count > 0);
    if (resolution !== this.#tiles.resolution && !isMoving) this.#begin(resolution);
    if (resolution === this.#tiles.resolution) {
      const isWhole = this.#paintTiles(this.#tiles.within(box), frame);
      if (!isWhole)
        this.changed(); // Requests another frame for the rest.
      else if (!isMoving) this.#rest(box);
    }
    if (this.#before) drawTiles(context, frame, this.#before, box);
    drawTiles(context, frame, this.#tiles, box);
  }

  #begin(resolution: number): void {
    this.#before = this.#tiles;
    this.#tiles = new TileSet(resolution);
  }

  // Keeps the tiles around the view, so that moving back by one view repaints nothing.
  #rest(box: Extent): void {
    this.#before = undefined;
    this.#tiles.trim(buffer(box, Math.max(getWidth(box), getHeight(box))));
  }

  /** Paints dirty tiles up to the limit per frame. Returns whether none is left. */
  #paintTiles(tiles: readonly Tile[], frame: FrameState): boolean {
    let painted = 0;
    for (const tile of tiles) {
      if (!tile.isDirty) continue;
      if (painted >= OBJECTS_A_FRAME) return false;
      painted += this.#paintTile(tile, frame.pixelRatio);
    }
    return true;
  }

  /** Returns the number of objects that were painted. */
  #paintTile(tile: Tile, pixelRatio: number): number {
    const context = this.#tiles.begin(tile, pixelRatio);
    if (!context) return 0;
    const { resolution } = this.#tiles;
    const shapes = this.#shapes.within(buffer(this.#tiles.box(tile), this.#margin * resolution));
    for (const shape of shapes) this.#painter.paint(context, shape, resolution);
    return shapes.length;
  }
}

function drawTiles(
  context: CanvasRenderingContext2D,
  frame: FrameState,
  set: TileSet,
  box: Extent,
): void {
  for (const tile of set.paintedWithin(box)) {
    // Tiles are placed on whole pixels. Otherwise there would be seams and blurred outlines.
    const [left, top, side] = placeOf(frame, set.box(tile));
    const [x, y] = [Math.round(left), Math.round(top)];
    const [width, height] = [Math.round(left + side) - x, Math.round(top + side) - y];
    context.clearRect(x, y, width, height);
    context.drawImage(tile.canvas, x, y, width, height);
  }
}
