import LayerGroup from 'ol/layer/Group';
import type { ObjectStore } from '../state/object_store';
import { AreaLayer } from './area_layer';
import { LabelLayer } from './label_layer';
import type { Look } from './look';

/** Shows an object store: areas with labels above them. */
export class ObjectLayer extends LayerGroup {
  readonly #areas: AreaLayer;
  readonly #labels: LabelLayer;
  readonly #stop: () => void;

  constructor(store: ObjectStore, look: Look) {
    const areas = new AreaLayer(store, look);
    const labels = new LabelLayer(store, look);
    super({ layers: [areas, labels] });
    this.#areas = areas;
    this.#labels = labels;
    this.#stop = store.onStep((delta) => {
      areas.update(delta);
      labels.update(delta);
    });
  }

  setLook(look: Look): void {
    this.#areas.setLook(look);
    this.#labels.setLook(look);
  }

  override disposeInternal(): void {
    this.#stop();
    this.#areas.dispose();
    this.#labels.dispose();
    super.disposeInternal();
  }
}
