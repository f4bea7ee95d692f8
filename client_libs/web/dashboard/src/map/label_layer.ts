import Feature from 'ol/Feature';
import VectorLayer from 'ol/layer/Vector';
import VectorSource from 'ol/source/Vector';
import type { Object$ } from '../state/model';
import type { ObjectDelta, ObjectStore } from '../state/object_store';
import { geometryOf, type Geometry } from './geometry';
import { labelStyle } from './label_style';
import type { Look } from './look';

/** Every change lays out all labels again, so changes are collected for this long, milliseconds. */
const TOGETHER_MS = 200;
/**
 * Labels are hidden at coarser resolutions, where objects are too small for them: metres per pixel.
 */
const FARTHEST = 0.05;

function featureOf({ id, label, shape }: Object$): Feature<Geometry> {
  const feature = new Feature<Geometry>(geometryOf(shape));
  feature.set('label', label, true);
  feature.setId(String(id));
  return feature;
}

/** Shows the labels of objects where there is room. */
export class LabelLayer extends VectorLayer {
  readonly #source: VectorSource<Feature<Geometry>>;
  /** Collected changes by object id. Undefined for removed objects. */
  #waiting = new Map<bigint, Object$ | undefined>();
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(store: ObjectStore, look: Look) {
    const features = [...store.objects.values()].map(featureOf);
    const source = new VectorSource<Feature<Geometry>>({ features });
    super({ source, declutter: true, maxResolution: FARTHEST });
    this.#source = source;
    this.setLook(look);
  }

  setLook(look: Look): void {
    this.setStyle(labelStyle(look));
  }

  update({ put, removed }: ObjectDelta): void {
    for (const id of removed) this.#waiting.set(id, undefined);
    for (const [id, object] of put) this.#waiting.set(id, object);
    this.#timer ??= setTimeout(() => this.#flush(), TOGETHER_MS);
  }

  override disposeInternal(): void {
    clearTimeout(this.#timer);
    super.disposeInternal();
  }

  #flush(): void {
    this.#timer = undefined;
    const waiting = this.#waiting;
    this.#waiting = new Map();
    const come: Feature<Geometry>[] = [];
    for (const [id, object] of waiting) {
      const old = this.#source.getFeatureById(String(id));
      if (old) this.#source.removeFeature(old);
      if (object) come.push(featureOf(object));
    }
    this.#source.addFeatures(come);
  }
}
