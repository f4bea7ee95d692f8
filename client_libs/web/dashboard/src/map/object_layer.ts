import LayerGroup from 'ol/layer/Group';
import type { Object$, Position } from '../state/model';
import type { ObjectStore } from '../state/object_store';
import { LabelLayer } from './label_layer';
import type { Look } from './look';
import { ShapeLayer } from './shape_layer';

/** The z-index of labels: above the content of all layers, below the marks of explorations. */
const ABOVE_SHAPES = 890;

/** Shows the objects of a layer, and their labels above the objects of all layers. */
export class ObjectLayer extends LayerGroup {
  readonly #shapes: ShapeLayer;
  readonly #labels: LabelLayer;
  readonly #stop: () => void;

  constructor(
    /** The name of the layer. */
    readonly name: string,
    store: ObjectStore,
    look: Look,
  ) {
    const shapes = new ShapeLayer(store, look);
    const labels = new LabelLayer(store, look);
    super({ layers: [shapes, labels] });
    this.#shapes = shapes;
    this.#labels = labels;
    this.#stop = store.onStep((delta) => {
      shapes.update(delta);
      labels.update(delta);
    });
  }

  override setZIndex(order: number): void {
    super.setZIndex(order);
    // Labels of upper layers take the room first.
    this.#labels.setZIndex(ABOVE_SHAPES + order / 1000);
  }

  setLook(look: Look): void {
    this.#shapes.setLook(look);
    this.#labels.setLook(look);
  }

  /** Returns the objects whose bounding boxes are at most a distance away from a position. */
  near(at: Position, distanceM: number): Object$[] {
    return this.#shapes.near(at, distanceM);
  }

  override disposeInternal(): void {
    this.#stop();
    this.#shapes.dispose();
    this.#labels.dispose();
    super.disposeInternal();
  }
}
