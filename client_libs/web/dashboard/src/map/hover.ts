import { effect, untracked } from '@preact/signals';
import Feature from 'ol/Feature';
import VectorLayer from 'ol/layer/Vector';
import type MapBrowserEvent from 'ol/MapBrowserEvent';
import type OlMap from 'ol/Map';
import VectorSource from 'ol/source/Vector';
import type { Object$, Position } from '../state/model';
import { drawableLayers } from '../state/objects';
import { objectsAt } from '../state/shapes';
import { visibleLayers } from '../state/site';
import { dark } from '../state/theme';
import { shown } from '../state/time';
import { geometryOf } from './geometry';
import { hoverStyle } from './hover_style';
import { ObjectLayer } from './object_layer';
import { clickReach } from './reach';
import { scale } from './scale';
import { toolHint } from './tools';

/** The z-index above content and below highlights. */
const ABOVE_CONTENT = 950;

/** The object that a click at a position would select. */
function objectUnder(map: OlMap, at: Position): Object$ | undefined {
  const reachM = clickReach(map);
  const near = map
    .getLayers()
    .getArray()
    .filter((layer) => layer instanceof ObjectLayer)
    .filter((layer) => layer.getVisible() && drawableLayers.peek().includes(layer.name))
    .flatMap((layer) => layer.near(at, reachM));
  return objectsAt(near, at, reachM)[0];
}

/** Outlines the object under the pointer, which a click would select, and shows a hand over it. */
export function showHover(map: OlMap): () => void {
  const source = new VectorSource();
  const layer = new VectorLayer({ source, zIndex: ABOVE_CONTENT });
  map.addLayer(layer);
  const viewport = map.getViewport();
  /** The position of the pointer on the map, pixels. Undefined while it is not there. */
  let pointer: number[] | undefined;
  let hovered: Object$ | undefined;

  const update = (): void => {
    const [x, y] = (pointer && map.getCoordinateFromPixel(pointer)) ?? [];
    const isAsked = x !== undefined && y !== undefined && toolHint.peek() === undefined;
    const object = isAsked ? objectUnder(map, [x, y]) : undefined;
    if (object === hovered) return;
    hovered = object;
    viewport?.style.setProperty('cursor', object ? 'pointer' : '');
    source.clear(true);
    const geometry = geometryOf(object?.shape);
    if (geometry) source.addFeature(new Feature(geometry));
  };

  const onMove = ({ pixel, dragging, originalEvent }: MapBrowserEvent): void => {
    const isTouch = originalEvent instanceof PointerEvent && originalEvent.pointerType === 'touch';
    pointer = dragging || isTouch ? undefined : pixel;
    update();
  };
  const onLeave = (): void => {
    pointer = undefined;
    update();
  };
  map.on('pointermove', onMove);
  map.on('moveend', update);
  viewport?.addEventListener('pointerleave', onLeave);
  const stops = [
    effect(() => layer.setStyle(hoverStyle({ dark: dark.value, scale: scale.value }))),
    // The object under a resting pointer may change, disappear or be hidden.
    effect(() => {
      shown.value.revision.value;
      visibleLayers.value;
      toolHint.value;
      untracked(update);
    }),
  ];
  return () => {
    for (const stop of stops) stop();
    map.un('pointermove', onMove);
    map.un('moveend', update);
    viewport?.removeEventListener('pointerleave', onLeave);
    map.removeLayer(layer);
  };
}
