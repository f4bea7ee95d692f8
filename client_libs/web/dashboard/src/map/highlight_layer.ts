import { computed, effect, untracked } from '@preact/signals';
import Feature from 'ol/Feature';
import Point from 'ol/geom/Point';
import Polygon from 'ol/geom/Polygon';
import VectorImageLayer from 'ol/layer/VectorImage';
import type OlMap from 'ol/Map';
import VectorSource from 'ol/source/Vector';
import CircleStyle from 'ol/style/Circle';
import Fill from 'ol/style/Fill';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import type { Object$ } from '../state/model';
import { highlight, selected } from '../state/selection';
import { dark } from '../state/theme';
import { shown } from '../state/time';
import { geometryOf, type Geometry } from './geometry';
import { showCells, type MarkColour } from './highlight_cells';
import type { Look } from './look';
import { scale } from './scale';
import { POINT_RADIUS } from './shape_paint';

/** The z-index above all content. */
const ABOVE_CONTENT = 1000;

const FOUND_CELLS: MarkColour = {
  light: [217, 72, 15],
  dark: [255, 210, 74],
  alpha: { light: 0.45, dark: 0.55 },
};

type Mark = 'found' | 'area' | 'point' | 'selected';

function mark(geometry: Geometry, kind: Mark): Feature {
  return new Feature({ geometry, kind });
}

function outline({ shape }: Object$, kind: Mark): Feature | undefined {
  const geometry = geometryOf(shape);
  return geometry && mark(geometry, kind);
}

function styles({ dark: isDark, scale: s }: Look): Record<Mark, Style[]> {
  const accent = isDark ? '#ffd24a' : '#d9480f';
  const soft = isDark ? 'rgba(255,210,74,.22)' : 'rgba(217,72,15,.16)';
  const ground = isDark ? 'rgba(0,0,0,.7)' : 'rgba(255,255,255,.9)';
  const line = (color: string, width: number, lineDash: number[] = []) =>
    new Style({
      stroke: new Stroke({ color, width: width * s, lineDash: lineDash.map((part) => part * s) }),
    });
  // Around the disc of a point, so that its colour stays visible.
  const ring = (color: string, width: number) =>
    new Style({
      image: new CircleStyle({
        radius: (POINT_RADIUS + 4) * s,
        stroke: new Stroke({ color, width: width * s }),
      }),
    });
  const disc = new CircleStyle({
    radius: 6 * s,
    fill: new Fill({ color: accent }),
    stroke: new Stroke({ color: ground, width: 2 * s }),
  });
  const fill = new Style({ fill: new Fill({ color: soft }) });
  return {
    found: [line(ground, 5), fill, line(accent, 2.5), ring(ground, 4.5), ring(accent, 2)],
    area: [line(ground, 4), line(accent, 2, [6, 5])],
    point: [new Style({ image: disc })],
    selected: [line(ground, 7), line(accent, 3.5), ring(ground, 5.5), ring(accent, 3)],
  };
}

/** The marks for the found objects, the point or area of the question, and the selected object. */
function marks(): Feature[] {
  const { objectIds, area, point } = highlight.value;
  const content = shown.value;
  const found = objectIds.map((id) => content.find(id)?.object);
  const all = [
    area && mark(new Polygon([area]), 'area'),
    ...found.map((object) => object && outline(object, 'found')),
    point && mark(new Point(point), 'point'),
    selected.value && outline(selected.value.object, 'selected'),
  ];
  return all.filter((feature) => feature !== undefined);
}

/** The inputs of `marks`. The marks need an update only if one of these values has changed. */
const marked = computed(() => {
  const content = shown.value;
  content.revision.value; // Recomputed after each commit, which may have moved objects.
  const found = highlight.value.objectIds.map((id) => content.find(id)?.object);
  return [highlight.value, selected.value?.object, ...found];
});

/**
 * Marks the found objects and cells, the point or area of the question, and the selected object.
 */
export function showHighlight(map: OlMap): () => void {
  const source = new VectorSource();
  const layer = new VectorImageLayer({ source, zIndex: ABOVE_CONTENT + 1, imageRatio: 1.5 });
  map.addLayer(layer);
  const stopCells = showCells(map, {
    cells: () => highlight.value.cells,
    colour: FOUND_CELLS,
    zIndex: ABOVE_CONTENT,
  });
  const stopStyle = effect(() => {
    const byMark = styles({ dark: dark.value, scale: scale.value });
    layer.setStyle((feature) => byMark[feature.get('kind') as Mark]);
  });
  let last: readonly unknown[] = [];
  const stopMarks = effect(() => {
    const now = marked.value;
    // Most commits do not change a marked object.
    if (now.length === last.length && now.every((thing, i) => thing === last[i])) return;
    last = now;
    source.clear(true);
    source.addFeatures(untracked(marks));
  });
  return () => {
    stopCells();
    stopStyle();
    stopMarks();
    map.removeLayer(layer);
  };
}
