// Objects that users draw, their layers and their labels.
import { create, ObjectSchema, polygonFromGeoJson, shapeFromGeoJson } from '@hypermap/client';
import { computed } from '@preact/signals';
import { live } from './live';
import { ShapeKind, type Object$, type Position, type Shape } from './model';
import { KINDS_OF_SHAPE, type KindOfShape } from './shapes';
import { layerNamed, layers } from './site';

/** The server reads this layer as its list of explorations, so users do not draw on it. */
export const OF_THE_SERVER = 'explorations';

/** The layers that users may draw on; the layer with the most objects comes first. */
export const drawableLayers = computed(() =>
  (layers.value ?? [])
    .filter(({ properties, name }) => properties?.hasShapes && name !== OF_THE_SERVER)
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

const KIND_OF: Record<KindOfShape, ShapeKind> = {
  polygon: ShapeKind.POLYGON,
  lineString: ShapeKind.LINE_STRING,
  point: ShapeKind.POINT,
};

/** The kinds of shape that the objects of a layer may have. */
export function kindsTakenBy(layer: string): readonly KindOfShape[] {
  const kinds = layerNamed(layer)?.shapeKinds ?? [];
  if (kinds.length === 0) return KINDS_OF_SHAPE;
  return KINDS_OF_SHAPE.filter((kind) => kinds.includes(KIND_OF[kind]));
}

export function drawnObject(label: string, shape: Shape): Object$ {
  return create(ObjectSchema, { label, shape, existence: 1 });
}

/** A small shape around a position: a square, a line or the point itself. */
export function smallShapeAt([x, y]: Position, kind: KindOfShape): Shape {
  switch (kind) {
    case 'polygon':
      return shapeFromGeoJson({ type: 'Polygon', coordinates: [squareAround([x, y], 0.5)] });
    case 'lineString': {
      const coordinates = [
        [x - 0.5, y],
        [x + 0.5, y],
      ];
      return shapeFromGeoJson({ type: 'LineString', coordinates });
    }
    case 'point':
      return shapeFromGeoJson({ type: 'Point', coordinates: [x, y] });
  }
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
