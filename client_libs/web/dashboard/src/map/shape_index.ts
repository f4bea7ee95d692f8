import { boundingExtent, type Extent } from 'ol/extent';
import RBush from 'ol/structs/RBush';
import { ringsOf, type Object$, type Position } from '../state/model';

/** An object with its rings and bounding box. */
export interface Shape {
  object: Object$;
  rings: Position[][];
  box: Extent;
}

/** The area of a box, square metres. */
export function boxArea([minX = 0, minY = 0, maxX = 0, maxY = 0]: Extent): number {
  return (maxX - minX) * (maxY - minY);
}

function shapeOf(object: Object$): Shape {
  const rings = object.polygon ? ringsOf(object.polygon) : [];
  return { object, rings, box: boundingExtent(rings[0] ?? []) };
}

/** The shapes of a layer, indexed by id and by bounding box. */
export class ShapeIndex {
  readonly #byId = new Map<bigint, Shape>();
  readonly #byPlace = new RBush<Shape>();

  constructor(objects: Iterable<Object$>) {
    const shapes = [...objects].map(shapeOf);
    for (const shape of shapes) this.#byId.set(shape.object.id, shape);
    this.#byPlace.load(
      shapes.map(({ box }) => box),
      shapes,
    );
  }

  /** Returns the bounding boxes in which the picture has changed. */
  put(object: Object$): Extent[] {
    const old = this.remove(object.id);
    const shape = shapeOf(object);
    this.#byId.set(object.id, shape);
    this.#byPlace.insert(shape.box, shape);
    return [...old, shape.box];
  }

  /** Returns the bounding boxes in which the picture has changed. */
  remove(id: bigint): Extent[] {
    const shape = this.#byId.get(id);
    if (!shape) return [];
    this.#byId.delete(id);
    this.#byPlace.remove(shape);
    return [shape.box];
  }

  /** Returns the shapes that touch a box, largest first, so that small ones are painted on top. */
  within(box: Extent): Shape[] {
    return this.#byPlace.getInExtent(box).sort((a, b) => boxArea(b.box) - boxArea(a.box));
  }
}
