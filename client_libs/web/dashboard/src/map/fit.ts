import { effect, signal } from '@preact/signals';
import { createEmpty, extend, isEmpty, type Extent } from 'ol/extent';
import type OlMap from 'ol/Map';
import type { GridStore } from '../state/grid_store';
import type { MapContent } from '../state/map_content';
import type { ObjectStore } from '../state/object_store';
import { loading, live } from '../state/live';
import { layers } from '../state/site';
import { view } from '../state/url';
import { setOut } from './motion';
import { scale } from './scale';

/** Around all of the content, pixels. */
const MARGIN = 16;

interface Fit {
  box: Extent;
  /** Left free around the box, pixels; larger on larger screens. */
  margin: number;
  /** No nearer than this, metres a pixel. */
  finest?: number;
  durationMs?: number;
}

/** What the map was fitted to last. */
export const fitted = signal<Fit>();

/** Shows a box in the part of the map that nothing covers. */
export function fitTo(map: OlMap, fit: Fit): void {
  const { box, margin, finest = 0, durationMs } = fit;
  const view = map.getView();
  fitted.value = fit;
  view.cancelAnimations();
  view.fit(box, {
    padding: Array<number>(4).fill(margin * scale.peek()),
    minResolution: finest,
    ...(durationMs !== undefined && { duration: durationMs, callback: setOut() }),
  });
}

function extendByGrid(box: Extent, store: GridStore): void {
  const known = store.knownBox();
  if (!store.geometry || !known) return;
  const { resolutionM, origin } = store.geometry;
  const { x = 0, y = 0, yaw = 0 } = origin ?? {};
  for (const col of [known.u0, known.u1]) {
    for (const row of [known.v0, known.v1]) {
      const [u, v] = [col * resolutionM, row * resolutionM];
      const px = x + Math.cos(yaw) * u - Math.sin(yaw) * v;
      const py = y + Math.sin(yaw) * u + Math.cos(yaw) * v;
      extend(box, [px, py, px, py]);
    }
  }
}

function extendByObjects(box: Extent, store: ObjectStore): void {
  for (const { polygon } of store.objects.values()) {
    for (const { x, y } of polygon?.outer?.points ?? []) extend(box, [x, y, x, y]);
  }
}

/** The box around all content, metres. Undefined when there is none. */
export function contentBox(content: MapContent): Extent | undefined {
  const box = createEmpty();
  for (const store of content.stores.value.values()) {
    if (store.type === 'grid') extendByGrid(box, store);
    else extendByObjects(box, store);
  }
  return isEmpty(box) ? undefined : box;
}

/** Shows all of the content. */
export function fitContent(map: OlMap, content: MapContent, durationMs?: number): boolean {
  const box = contentBox(content);
  if (box) fitTo(map, { box, margin: MARGIN, ...(durationMs !== undefined && { durationMs }) });
  return box !== undefined;
}

/** Keeps in mind where the map is looked at: its middle, whatever covers it. */
export function noteView(map: OlMap): void {
  const { center, resolution } = map.getView().getState();
  const [x, y] = center;
  if (x === undefined || y === undefined) return;
  view.value = { center: [x, y], resolution };
}

/** Runs something when all that is to be drawn now has been. */
function afterDrawing(run: () => void): void {
  // What covers the map is measured between the two.
  requestAnimationFrame(() => requestAnimationFrame(run));
}

/** Shows all of a map when its first content has come, unless the address said where to look. */
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
