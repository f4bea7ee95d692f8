import { batch } from '@preact/signals';
import { NO_HIGHLIGHT, highlight, selectedId } from './selection';
import { layerViews, layers, mapName } from './site';
import { asOf } from './time';
import { view } from './url';

/** Shows all of another map, live and with the default visibility of its layers. */
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
