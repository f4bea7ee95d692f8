import {
  create,
  ObjectSchema,
  shapeFromGeoJson,
  shapeToGeoJson,
  type ShapeGeometry,
} from '@hypermap/client';
import { boundingExtent, intersects, type Extent } from 'ol/extent';
import { expect, test } from 'vitest';
import type { Object$ } from '../state/model';
import { ShapeIndex } from './shape_index';

const KINDS = ['Polygon', 'LineString', 'Point'] as const;
type Kind = (typeof KINDS)[number];

function geometry(kind: Kind, x: number, y: number, side: number): ShapeGeometry {
  const corners = [
    [x, y],
    [x + side, y],
    [x + side, y + side],
    [x, y + side],
  ];
  if (kind === 'Polygon') return { type: kind, coordinates: [corners] };
  if (kind === 'LineString') return { type: kind, coordinates: corners };
  return { type: kind, coordinates: [x, y] };
}

/** An object whose bounding box is a square, or a point. */
function some(id: bigint, kind: Kind, x: number, y: number, side: number): Object$ {
  const shape = shapeFromGeoJson(geometry(kind, x, y, side));
  const label = `${kind} of ${kind === 'Point' ? 0 : side} m`;
  return create(ObjectSchema, { id, label, shape });
}

function extentOf({ shape }: Object$): Extent {
  const found = shape && shapeToGeoJson(shape);
  if (!found) return [];
  if (found.type === 'Point') return [...found.coordinates, ...found.coordinates];
  return boundingExtent(found.type === 'Polygon' ? found.coordinates.flat() : found.coordinates);
}

/** The place of an object in the order of painting: its kind, then its side, the largest first. */
function orderOf({ label }: Object$): [number, number] {
  const [kind = '', , side] = label.split(' ');
  return [KINDS.indexOf(kind as Kind), -Number(side)];
}

// mulberry32, a seeded generator that makes failures reproducible.
function random(seed: number): () => number {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

test.each([1, 2, 3])(
  'finds what a scan of all objects finds, in painting order (seed %i)',
  (seed) => {
    const next = random(seed);
    const kind = () => KINDS[Math.floor(next() * KINDS.length)] ?? 'Point';
    const put = (id: bigint) => some(id, kind(), next() * 100, next() * 100, 0.1 + next() * 8);
    const all = new Map<bigint, Object$>();
    for (let id = 1n; id <= 200n; id++) all.set(id, put(id));
    const index = new ShapeIndex(all.values());
    for (let i = 0; i < 300; i++) {
      const id = BigInt(1 + Math.floor(next() * 250));
      if (next() < 0.3) {
        const old = all.get(id);
        expect(index.remove(id)).toEqual(old ? [extentOf(old)] : []);
        all.delete(id);
      } else {
        const [old, now] = [all.get(id), put(id)];
        expect(index.put(now)).toEqual([...(old ? [extentOf(old)] : []), extentOf(now)]);
        all.set(id, now);
      }
      const [x, y, side] = [next() * 100, next() * 100, next() * 30];
      const area: Extent = [x, y, x + side, y + side];
      const there = [...all.values()].filter((object) => intersects(extentOf(object), area));
      const found = index.within(area);
      expect(new Set(found.map(({ object }) => object))).toEqual(new Set(there));
      const order = found.map(({ object }) => orderOf(object));
      expect(order).toEqual(order.toSorted((a, b) => a[0] - b[0] || a[1] - b[1]));
    }
  },
);

test('finds what is near a position', () => {
  const index = new ShapeIndex([some(1n, 'Point', 0, 0, 0), some(2n, 'Polygon', 5, 5, 1)]);
  const near = (x: number, y: number, distanceM: number) =>
    index.near([x, y], distanceM).map(({ id }) => id);
  expect(near(0.2, 0, 0.1)).toEqual([]);
  expect(near(0.2, 0, 0.3)).toEqual([1n]);
  expect(near(4.9, 5.5, 0.3)).toEqual([2n]);
});

test('leaves out objects without a shape', () => {
  const point = some(1n, 'Point', 0, 0, 0);
  const index = new ShapeIndex([point, create(ObjectSchema, { id: 2n, label: 'nowhere' })]);
  expect(index.put({ ...point, shape: undefined })).toEqual([[0, 0, 0, 0]]);
  expect(index.within([-1, -1, 1, 1])).toEqual([]);
});
