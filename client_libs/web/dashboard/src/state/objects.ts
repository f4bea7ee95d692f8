// Objects that users draw, their layers and their labels.
import { create, ObjectSchema, polygonFromGeoJson } from '@hypermap/client';
import { computed } from '@preact/signals';
import { live } from './live';
import { LayerKind, type Object$, type Position } from './model';
import { layers } from './site';

/** The server reads this layer as its list of explorations, so users do not draw on it. */
const OF_THE_SERVER = 'explorations';

/** The layers that users may draw on; the layer with the most objects comes first. */
export const drawableLayers = computed(() =>
  (layers.value ?? [])
    .filter(({ kind, name }) => kind === LayerKind.SEMANTIC && name !== OF_THE_SERVER)
    .sort((a, b) => Number(b.size - a.size))
    .map(({ name }) => name),
);

/** All labels on the drawable layers, sorted. */
export const knownLabels = computed(() => {
  live.value.revision.value; // Recomputed after each commit.
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

/** The closed ring of a square around a point. */
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

/** The bounding box of an object: min x, min y, max x, max y. Undefined if it has no shape. */
export function boxOf({ polygon }: Object$): [number, number, number, number] | undefined {
  const points = polygon?.outer?.points ?? [];
  if (points.length === 0) return undefined;
  const xs = points.map(({ x }) => x);
  const ys = points.map(({ y }) => y);
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}
