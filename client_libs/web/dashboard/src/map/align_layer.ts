import { computed, effect } from '@preact/signals';
import Feature from 'ol/Feature';
import type Geometry from 'ol/geom/Geometry';
import LineString from 'ol/geom/LineString';
import Point from 'ol/geom/Point';
import VectorImageLayer from 'ol/layer/VectorImage';
import type OlMap from 'ol/Map';
import VectorSource from 'ol/source/Vector';
import { aligning, estimate, placement, resultOf, sourceMap } from '../state/align';
import type { Position } from '../state/model';
import { overlay } from '../state/overlay';
import { begunPair, pairs, type PlacePair } from '../state/place_pairs';
import { transform, transformGrid } from '../state/rigid';
import { dark } from '../state/theme';
import { alignStyle, OVERLAY_COLOUR, type AlignMark } from './align_style';
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

function feature(mark: AlignMark, geometry: Geometry, name = ''): Feature {
  return new Feature({ geometry, mark, name });
}

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
    return [feature('object', geometry)];
  });
}

function sourceMark(place: Position): Feature {
  return feature('source', new Point(transform(placement.value, place)));
}

function pairMarks(pair: PlacePair, index: number): Feature[] {
  const answer = estimate.answer.value;
  const disagrees = answer && resultOf(answer, pair)?.agrees === false;
  const ends = [transform(placement.value, pair.source), pair.target];
  return [
    feature(disagrees ? 'disagreement' : 'way', new LineString(ends)),
    sourceMark(pair.source),
    feature('target', new Point(pair.target), `${index + 1}`),
  ];
}

function placedPairs(): Feature[] {
  if (!drawn.value) return [];
  const begun = begunPair.value;
  return [...pairs.value.flatMap(pairMarks), ...(begun ? [sourceMark(begun)] : [])];
}

function fill(source: VectorSource, features: Feature[]): void {
  source.clear(true);
  source.addFeatures(features);
}

/** Shows the other map over the shown one, at the estimated transform, and the pairs of places, while the panel is open. */
export function showAlignment(map: OlMap): () => void {
  const [objects, marks] = [new VectorSource(), new VectorSource()];
  const layers = [
    new VectorImageLayer({ source: objects, zIndex: ABOVE_EXPLORATION, imageRatio: 1.5 }),
    new VectorImageLayer({ source: marks, zIndex: ABOVE_EXPLORATION + 1, imageRatio: 1.5 }),
  ];
  for (const layer of layers) map.addLayer(layer);
  const stops = [
    showCells(map, { cells: placedCells, colour: OVERLAY_COLOUR, zIndex: ABOVE_EXPLORATION }),
    effect(() => {
      const style = alignStyle({ dark: dark.value, scale: scale.value });
      for (const layer of layers) layer.setStyle(style);
    }),
    effect(() => fill(objects, placedObjects())),
    effect(() => fill(marks, placedPairs())),
  ];
  return () => {
    for (const stop of stops) stop();
    for (const layer of layers) map.removeLayer(layer);
  };
}
