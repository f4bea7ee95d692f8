import { batch } from '@preact/signals';
import { NO_HIGHLIGHT, highlight, selectedId } from './selection';
import { layerViews, layers, mapName } from './site';
import { asOf } from './time';
import { view } from './url';

/** Shows another map: live, whole, with its layers as they are by default. */
export function showMap(name: string): void {
  if (mapName.value === name) return;
  batch(() => {
    layers.value = undefined;
    layerViews.value = new Map();
    asOf.value = undefined;
    view.value = undefined;
    selectedId.value = undefined;
    highlight.value = NO_HIGHLIGHT;
    mapName.value = name;
  });
}
