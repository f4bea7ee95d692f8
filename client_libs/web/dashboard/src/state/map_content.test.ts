import { AnswerStatus, ChangeKind, ChangeSchema, LayerPartSchema, create } from '@hypermap/client';
import { describe, expect, test } from 'vitest';
import { MapContent } from './map_content';
import type { ObjectDelta } from './object_store';

const put = (id: bigint, label: string, layer = 'objects', kind = ChangeKind.PUT) =>
  create(ChangeSchema, { kind, layer, objectId: id, object: { id, label } });
const remove = (id: bigint, kind = ChangeKind.REMOVE) =>
  create(ChangeSchema, { kind, layer: 'objects', objectId: id });

function labels(content: MapContent, layer = 'objects'): string[] {
  return [...content.objects(layer).values()].map(({ label }) => label);
}

describe('content', () => {
  test('is the result of all changes', () => {
    const content = new MapContent();
    for (const change of [
      put(1n, 'chair'),
      put(2n, 'cup'),
      put(1n, 'table'),
      remove(2n),
      put(3n, 'plant', 'objects', ChangeKind.ENTER),
      put(4n, 'bed', 'objects'),
      remove(4n, ChangeKind.LEAVE),
    ]) {
      content.apply(change);
    }
    content.step(7n);
    expect(labels(content)).toEqual(['table', 'plant']);
    expect(content.revision.value).toBe(7n);
  });

  test('finds an object on any layer', () => {
    const content = new MapContent();
    content.apply(put(1n, 'chair', 'a'));
    content.apply(put(2n, 'cup', 'b'));
    expect(content.find(2n)).toMatchObject({ layer: 'b', object: { label: 'cup' } });
    expect(content.find(3n)).toBeUndefined();
  });

  test('drops a deleted layer, and starts a new store for another layer of the same name', () => {
    const content = new MapContent();
    content.apply(put(1n, 'chair'));
    const before = content.stores.value.get('objects');
    content.apply(create(ChangeSchema, { kind: ChangeKind.LAYER_DELETED, layer: 'objects' }));
    expect(content.stores.value.has('objects')).toBe(false);
    content.apply(put(2n, 'cup'));
    expect(labels(content)).toEqual(['cup']);
    expect(content.stores.value.get('objects')).not.toBe(before);
  });

  test('has a store for an empty layer, but none for a layer that cannot answer', () => {
    const content = new MapContent();
    const status = AnswerStatus.VALUE;
    content.add(create(LayerPartSchema, { layer: 'objects', status }));
    content.add(create(LayerPartSchema, { layer: 'floor', status, cells: {} }));
    content.add(create(LayerPartSchema, { layer: 'elsewhere', status: AnswerStatus.NO_TRANSFORM }));
    const types = [...content.stores.value].map(([name, { type }]) => [name, type]);
    expect(types).toEqual([
      ['objects', 'objects'],
      ['floor', 'grid'],
    ]);
  });

  test('notifies listeners once of each object that a step put or removed', () => {
    const content = new MapContent();
    content.apply(put(1n, 'chair'));
    content.apply(put(2n, 'cup'));
    content.step(1n);
    const deltas: ObjectDelta[] = [];
    const store = content.stores.value.get('objects');
    if (store?.type !== 'objects') throw new Error('no store of objects');
    store.onStep((delta) => deltas.push(delta));
    content.apply(put(3n, 'plant'));
    content.apply(remove(3n));
    content.apply(put(1n, 'table'));
    content.apply(remove(2n));
    content.step(2n);
    content.step(3n);
    expect(deltas.map(({ put, removed }) => [[...put.keys()], [...removed]])).toEqual([
      [[1n], [3n, 2n]],
    ]);
  });
});
