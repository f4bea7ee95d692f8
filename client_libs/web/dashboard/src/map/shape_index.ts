import { buffer, type Extent } from 'ol/extent';
import RBush from 'ol/structs/RBush';
import type { Object$, Position } from '../state/model';
import { boxOf, kindOf, KINDS_OF_SHAPE } from '../state/shapes';

/** An object with its bounding box. */
export interface Placed {
  object: Object$;
  box: Extent;
}

/** The area of a box, square metres. */
function boxArea([minX = 0, minY = 0, maxX = 0, maxY = 0]: Extent): number {
  return (maxX - minX) * (maxY - minY);
}

function rankOf({ object }: Placed): number {
  const kind = kindOf(object);
  return kind ? KINDS_OF_SHAPE.indexOf(kind) : 0;
}

/** The objects of a layer that have a shape, indexed by id and by bounding box. */
export class ShapeIndex {
  readonly #byId = new Map<bigint, Placed>();
  readonly #byPlace = new RBush<Placed>();

  constructor(objects: Iterable<Object$>) {
    const all: Placed[] = [];
    for (const object of objects) {
      const box = boxOf(object);
      if (box) all.push({ object, box });
    }
    for (const placed of all) this.#byId.set(placed.object.id, placed);
    this.#byPlace.load(
      all.map(({ box }) => box),
      all,
    );
  }

  /** Returns the bounding boxes in which the picture has changed. */
  put(object: Object$): Extent[] {
    const old = this.remove(object.id);
    const box = boxOf(object);
    if (!box) return old;
    const placed = { object, box };
    this.#byId.set(object.id, placed);
    this.#byPlace.insert(box, placed);
    return [...old, box];
  }

  /** Returns the bounding boxes in which the picture has changed. */
  remove(id: bigint): Extent[] {
    const placed = this.#byId.get(id);
    if (!placed) return [];
    this.#byId.delete(id);
    this.#byPlace.remove(placed);
    return [placed.box];
  }

  /**
   * Returns the objects whose boxes touch a box, in the order in which they are painted: polygons,
   * lines, points, and of each kind the largest first, so that small ones are on top.
   */
  within(box: Extent): Placed[] {
    return this.#byPlace
      .getInExtent(box)
      .sort((a, b) => rankOf(a) - rankOf(b) || boxArea(b.box) - boxArea(a.box));
  }

  /** Returns the objects whose boxes are at most a distance away from a position. */
  near([x, y]: Position, distanceM: number): Object$[] {
    return this.#byPlace.getInExtent(buffer([x, y, x, y], distanceM)).map(({ object }) => object);
  }
}
