import { effect, untracked } from '@preact/signals';
import type OlMap from 'ol/Map';
import { cellStores } from '../state/cell_stores';
import { highlight } from '../state/selection';
import { dark } from '../state/theme';
import type { Rgb } from './colours';
import { GridLayer } from './grid_layer';
import type { Colouring } from './grid_palette';
import { scale } from './scale';

/** Colours all cells alike, whatever their values are. */
const COLOURING: Colouring = {
  ramp: (isDark) => {
    const colour: Rgb = isDark ? [255, 210, 74] : [217, 72, 15];
    const alpha = isDark ? 0.55 : 0.45;
    return { stops: [colour, colour], alphas: [alpha, alpha] };
  },
  range: { min: 0, max: 1 },
};

/** Marks the cells that a search found, possibly millions. */
export function showCells(map: OlMap, zIndex: number): () => void {
  const shown: GridLayer[] = [];
  const clear = (): void => {
    for (const layer of shown.splice(0)) {
      map.removeLayer(layer);
      layer.dispose();
    }
  };
  const stopCells = effect(() => {
    const stores = cellStores(highlight.value.cells);
    untracked(() => {
      clear();
      const look = { dark: dark.value, scale: scale.value };
      for (const store of stores) {
        const layer = new GridLayer(store, COLOURING, look);
        layer.setZIndex(zIndex);
        map.addLayer(layer);
        shown.push(layer);
      }
    });
  });
  const stopLook = effect(() => {
    const look = { dark: dark.value, scale: scale.value };
    for (const layer of shown) layer.setLook(look);
  });
  return () => {
    stopCells();
    stopLook();
    clear();
  };
}
