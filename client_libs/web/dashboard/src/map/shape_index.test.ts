import { create, ObjectSchema } from '@hypermap/client';
import { intersects, type Extent } from 'ol/extent';
import { expect, test } from 'vitest';
import type { Object$ } from '../state/model';
import { ShapeIndex, boxArea } from './shape_index';

function box(id: bigint, x: number, y: number, side: number): Object$ {
  const points = [
    { x, y },
    { x: x + side, y },
    { x: x + side, y: y + side },
    { x, y: y + side },
  ];
  return create(ObjectSchema, { id, label: 'box', polygon: { outer: { points } } });
}

function extentOf(object: Object$): Extent {
  const points = object.polygon?.outer?.points ?? [];
  const [xs, ys] = [points.map(({ x }) => x), points.map(({ y }) => y)];
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
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

test.each([1, 2, 3])('finds the same shapes as a scan of all objects (seed %i)', (seed) => {
  const next = random(seed);
  const some = (id: bigint) => box(id, next() * 100, next() * 100, 0.1 + next() * 8);
  const all = new Map<bigint, Object$>();
  for (let id = 1n; id <= 200n; id++) all.set(id, some(id));
  const index = new ShapeIndex(all.values());
  for (let i = 0; i < 300; i++) {
    const id = BigInt(1 + Math.floor(next() * 250));
    if (next() < 0.3) {
      const old = all.get(id);
      expect(index.remove(id)).toEqual(old ? [extentOf(old)] : []);
      all.delete(id);
    } else {
      const [old, now] = [all.get(id), some(id)];
      expect(index.put(now)).toEqual([...(old ? [extentOf(old)] : []), extentOf(now)]);
      all.set(id, now);
    }
    const [x, y, side] = [next() * 100, next() * 100, next() * 30];
    const area: Extent = [x, y, x + side, y + side];
    const there = [...all.values()].filter((object) => intersects(extentOf(object), area));
    const found = index.within(area);
    expect(new Set(found.map(({ object }) => object))).toEqual(new Set(there));
    const sizes = found.map((shape) => boxArea(shape.box));
    expect(sizes).toEqual(sizes.toSorted((a, b) => b - a));
  }
});
