import { effect, untracked } from '@preact/signals';
import type OlMap from 'ol/Map';
import { cellStores } from '../state/cell_stores';
import type { CellRuns } from '../state/model';
import { dark } from '../state/theme';
import type { Rgb } from './colours';
import { GridLayer } from './grid_layer';
import type { Colouring } from './grid_palette';
import { scale } from './scale';

/** One colour in the light and in the dark theme. */
export interface MarkColour {
  light: Rgb;
  dark: Rgb;
  /** In [0, 1]. */
  alpha: { light: number; dark: number };
}

/** Colours all cells alike, whatever their values are. */
function colouringBy({ light, dark: onDark, alpha }: MarkColour): Colouring {
  return {
    ramp: (isDark) => {
      const colour = isDark ? onDark : light;
      const opacity = isDark ? alpha.dark : alpha.light;
      return { stops: [colour, colour], alphas: [opacity, opacity] };
    },
    range: { min: 0, max: 1 },
  };
}

export interface MarkedCells {
  /** The cells, possibly millions. Reads signals: the marks follow them. */
  cells: () => readonly CellRuns[];
  colour: MarkColour;
  zIndex: number;
}

/** Marks cells in one colour. */
export function showCells(map: OlMap, { cells, colour, zIndex }: MarkedCells): () => void {
  const colouring = colouringBy(colour);
  const shown: GridLayer[] = [];
  const clear = (): void => {
    for (const layer of shown.splice(0)) {
      map.removeLayer(layer);
      layer.dispose();
    }
  };
  const stopCells = effect(() => {
    const stores = cellStores(cells());
    untracked(() => {
      clear();
      const look = { dark: dark.value, scale: scale.value };
      for (const store of stores) {
        const layer = new GridLayer(store, colouring, look);
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
