import { effect, signal } from '@preact/signals';
import { createEmpty, extend, isEmpty, type Extent } from 'ol/extent';
import type OlMap from 'ol/Map';
import type { GridStore } from '../state/grid_store';
import type { MapContent } from '../state/map_content';
import type { ObjectStore } from '../state/object_store';
import { loading, live } from '../state/live';
import { transform } from '../state/rigid';
import { boxOf } from '../state/shapes';
import { layers } from '../state/site';
import { view } from '../state/url';
import { beginMove } from './motion';
import { scale } from './scale';

/** The margin around all of the content, pixels. */
const MARGIN = 16;
/** The finest resolution that the map moves to by itself, metres per pixel. */
const NEAREST = 0.005;

interface Fit {
  box: Extent;
  /** The margin around the box, pixels before scaling for large screens. */
  margin: number;
  durationMs?: number;
}

/** The last fit of the map. */
export const fitted = signal<Fit>();

/** Fits a box into the part of the map that no panel covers. */
export function fitTo(map: OlMap, fit: Fit): void {
  const { box, margin, durationMs } = fit;
  const view = map.getView();
  fitted.value = fit;
  view.cancelAnimations();
  view.fit(box, {
    padding: Array<number>(4).fill(margin * scale.peek()),
    minResolution: NEAREST,
    ...(durationMs !== undefined && { duration: durationMs, callback: beginMove() }),
  });
}

function extendByGrid(box: Extent, store: GridStore): void {
  const known = store.knownBox();
  if (!store.geometry || !known) return;
  const { resolutionM, origin } = store.geometry;
  const { x = 0, y = 0, yaw = 0 } = origin ?? {};
  for (const col of [known.u0, known.u1]) {
    for (const row of [known.v0, known.v1]) {
      const [px, py] = transform({ x, y, yaw }, [col * resolutionM, row * resolutionM]);
      extend(box, [px, py, px, py]);
    }
  }
}

function extendByObjects(box: Extent, store: ObjectStore): void {
  for (const object of store.objects.values()) {
    const around = boxOf(object);
    if (around) extend(box, around);
  }
}

/** The bounding box of all content, metres. Undefined if there is none. */
export function contentBox(content: MapContent): Extent | undefined {
  const box = createEmpty();
  for (const store of content.stores.value.values()) {
    if (store.type === 'grid') extendByGrid(box, store);
    else extendByObjects(box, store);
  }
  return isEmpty(box) ? undefined : box;
}

/** Fits all of the content into the view. Returns false if there is none. */
export function fitContent(map: OlMap, content: MapContent, durationMs?: number): boolean {
  const box = contentBox(content);
  if (box) fitTo(map, { box, margin: MARGIN, ...(durationMs !== undefined && { durationMs }) });
  return box !== undefined;
}

/** Stores the view for the page address: the centre of the whole map element and the resolution. */
export function noteView(map: OlMap): void {
  const { center, resolution } = map.getView().getState();
  const [x, y] = center;
  if (x === undefined || y === undefined) return;
  view.value = { center: [x, y], resolution };
}

/** Runs a function after the next frame has been drawn. */
function afterDrawing(run: () => void): void {
  // A ResizeObserver measures the panels between the two frames.
  requestAnimationFrame(() => requestAnimationFrame(run));
}

/** Fits a map into the view when its first content has loaded, unless the address has a view. */
export function fitWhenThere(map: OlMap): () => void {
  let isDue = false;
  let hasEnded = false;
  const fit = (): void => {
    isDue = false;
    if (hasEnded || view.peek() || loading.peek()) return;
    if (fitContent(map, live.peek())) noteView(map);
  };
  const stop = effect(() => {
    if (view.value || loading.value || !layers.value || !contentBox(live.value)) return;
    if (!isDue) afterDrawing(fit);
    isDue = true;
  });
  return () => {
    hasEnded = true;
    stop();
  };
}
