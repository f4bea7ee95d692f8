import { effect, untracked } from '@preact/signals';
import type OlMap from 'ol/Map';
import type { LayerStore } from '../state/map_content';
import type { Layer } from '../state/model';
import { layers, viewOf } from '../state/site';
import { dark } from '../state/theme';
import { shown } from '../state/time';
import { GridLayer } from './grid_layer';
import { colouringOf } from './grid_palette';
import { ObjectLayer } from './object_layer';
import { scale } from './scale';

interface Drawn {
  store: LayerStore;
  drawing: GridLayer | ObjectLayer;
}

function draw(layer: Layer, store: LayerStore): Drawn {
  const look = { dark: dark.value, scale: scale.value };
  const drawing =
    store.type === 'grid'
      ? new GridLayer(store, colouringOf(layer), look)
      : new ObjectLayer(layer.name, store, look);
  return { store, drawing };
}

/** Keeps one OpenLayers layer for each layer of the shown content, in the same order. */
export function showContent(map: OlMap): () => void {
  const drawn = new Map<string, Drawn>();

  const drop = (name: string): void => {
    const old = drawn.get(name);
    if (!old) return;
    drawn.delete(name);
    map.removeLayer(old.drawing);
    old.drawing.dispose();
  };

  const stopContent = effect(() => {
    const stores = shown.value.stores.value;
    const known = layers.value ?? [];
    untracked(() => {
      for (const [name, { store }] of drawn) if (stores.get(name) !== store) drop(name);
      known.forEach((layer, order) => {
        const store = stores.get(layer.name);
        if (!store) return;
        const entry = drawn.get(layer.name) ?? draw(layer, store);
        if (!drawn.has(layer.name)) map.addLayer(entry.drawing);
        drawn.set(layer.name, entry);
        entry.drawing.setZIndex(order);
      });
    });
  });

  const stopViews = effect(() => {
    shown.value.stores.value; // Runs again for layers that are added later.
    for (const layer of layers.value ?? []) {
      const { visible, opacity } = viewOf(layer);
      const drawing = drawn.get(layer.name)?.drawing;
      drawing?.setVisible(visible);
      drawing?.setOpacity(opacity);
    }
  });

  const stopLook = effect(() => {
    const look = { dark: dark.value, scale: scale.value };
    for (const { drawing } of drawn.values()) drawing.setLook(look);
  });

  return () => {
    stopContent();
    stopViews();
    stopLook();
    for (const name of [...drawn.keys()]) drop(name);
  };
}
