import { computed, effect } from '@preact/signals';
import Feature from 'ol/Feature';
import VectorImageLayer from 'ol/layer/VectorImage';
import type OlMap from 'ol/Map';
import VectorSource from 'ol/source/Vector';
import { aligning, placement, sourceMap } from '../state/align';
import { overlay } from '../state/overlay';
import { transformGrid } from '../state/rigid';
import { dark } from '../state/theme';
import { alignStyle, OVERLAY_COLOUR } from './align_style';
import { geometryOf } from './geometry';
import { showCells } from './highlight_cells';
import { scale } from './scale';

/** The z-index above content and the marks of explorations, below highlights. */
const ABOVE_EXPLORATION = 940;

/** The overlay while it is drawn: while the panel is open, and its map is still the chosen one. */
const drawn = computed(() => {
  const content = overlay.answer.value;
  return aligning.value && content && content.map === sourceMap.value ? content : undefined;
});

function placedCells() {
  const pose = placement.value;
  const cells = drawn.value?.cells ?? [];
  return cells.map((runs) =>
    runs.grid ? { ...runs, grid: transformGrid(pose, runs.grid) } : runs,
  );
}

function placedObjects(): Feature[] {
  const { x, y, yaw } = placement.value;
  return (drawn.value?.objects ?? []).flatMap(({ shape }) => {
    const geometry = geometryOf(shape);
    if (!geometry) return [];
    geometry.rotate(yaw, [0, 0]);
    geometry.translate(x, y);
    return [new Feature({ geometry, mark: 'object' })];
  });
}

/** Shows the other map over the shown one, at the estimated transform, while the panel is open. */
export function showAlignment(map: OlMap): () => void {
  const source = new VectorSource();
  const layer = new VectorImageLayer({ source, zIndex: ABOVE_EXPLORATION, imageRatio: 1.5 });
  map.addLayer(layer);
  const stops = [
    showCells(map, { cells: placedCells, colour: OVERLAY_COLOUR, zIndex: ABOVE_EXPLORATION }),
    effect(() => layer.setStyle(alignStyle({ dark: dark.value, scale: scale.value }))),
    effect(() => {
      const features = placedObjects();
      source.clear(true);
      source.addFeatures(features);
    }),
  ];
  return () => {
    for (const stop of stops) stop();
    map.removeLayer(layer);
  };
}
