// Objects as people make and name them.
import { create, ObjectSchema, polygonFromGeoJson } from '@hypermap/client';
import { computed } from '@preact/signals';
import { live } from './live';
import { LayerKind, type Object$, type Position } from './model';
import { layers } from './site';

/** Made by the server; what people draw there would be taken for its own. */
const OF_THE_SERVER = 'explorations';

/** Layers that people may draw on, the one with the most objects first. */
export const drawableLayers = computed(() =>
  (layers.value ?? [])
    .filter(({ kind, name }) => kind === LayerKind.SEMANTIC && name !== OF_THE_SERVER)
    .sort((a, b) => Number(b.size - a.size))
    .map(({ name }) => name),
);

/** All labels on these layers, sorted. */
export const knownLabels = computed(() => {
  live.value.revision.value; // again after each step
  const labels = new Set<string>();
  for (const layer of drawableLayers.value) {
    for (const { label } of live.value.objects(layer).values()) labels.add(label);
  }
  return [...labels].sort((a, b) => a.localeCompare(b));
});

export function drawnObject(label: string, outer: Position[]): Object$ {
  return create(ObjectSchema, { label, polygon: polygonOf([outer]), existence: 1 });
}

export function polygonOf(rings: Position[][]) {
  return polygonFromGeoJson({ type: 'Polygon', coordinates: rings });
}

/** A square around a point, closed. */
export function squareAround([x, y]: Position, sideM: number): Position[] {
  const h = sideM / 2;
  return [
    [x - h, y - h],
    [x + h, y - h],
    [x + h, y + h],
    [x - h, y + h],
    [x - h, y - h],
  ];
}

/** The box around an object: min x, min y, max x, max y. Undefined for one without a shape. */
export function boxOf({ polygon }: Object$): [number, number, number, number] | undefined {
  const points = polygon?.outer?.points ?? [];
  if (points.length === 0) return undefined;
  const xs = points.map(({ x }) => x);
  const ys = points.map(({ y }) => y);
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}
