import { describe, expect, it } from 'vitest';
import { EditHistory, StaleEdit, type WantedEdit } from './edit_history';
import type { Object$ } from './model';

/** A layer that assigns ids and versions like the server. */
class Layer {
  readonly objects = new Map<bigint, { label: string; version: bigint }>();
  reachable = true;
  #nextId = 1n;
  #revision = 0n;

  readonly apply = async ({ id, version, object }: WantedEdit) => {
    const before = this.objects.get(id);
    if (id !== 0n && before?.version !== version) throw new StaleEdit('another version');
    if (!this.reachable) throw new Error('not reached');
    const revision = ++this.#revision;
    if (!object) {
      this.objects.delete(id);
      return { id: 0n, revision };
    }
    const putId = id === 0n ? this.#nextId++ : id;
    this.objects.set(putId, { label: object.label, version: revision });
    return { id: putId, revision };
  };

  /** The object as a watch would deliver it. */
  get(id: bigint): Object$ {
    return { id, ...this.objects.get(id) } as Object$;
  }

  labels(): string[] {
    return [...this.objects.values()].map(({ label }) => label);
  }
}

const named = (label: string) => ({ label }) as Object$;

async function drawn(label: string) {
  const layer = new Layer();
  const history = new EditHistory(layer.apply);
  const edit = { title: `draw ${label}`, layer: 'objects', before: undefined, after: named(label) };
  const id = await history.do(edit);
  return { layer, history, id };
}

describe('EditHistory', () => {
  it('undoes and redoes a drawn object', async () => {
    const { layer, history } = await drawn('chair');
    await history.undo();
    expect(layer.labels()).toEqual([]);
    expect(history.redoTitle).toBe('draw chair');
    await history.redo();
    expect(layer.labels()).toEqual(['chair']);
  });

  it('undoes edits of an object whose id has changed in the meantime', async () => {
    const { layer, history, id } = await drawn('chair');
    const chair = layer.get(id);
    await history.do({ title: 'relabel', layer: 'objects', before: chair, after: named('sofa') });
    const sofa = layer.get(id);
    await history.do({ title: 'delete', layer: 'objects', before: sofa, after: undefined });
    expect(layer.labels()).toEqual([]);

    await history.undo();
    expect(layer.labels()).toEqual(['sofa']);
    await history.undo();
    expect(layer.labels()).toEqual(['chair']);
    await history.undo();
    expect(layer.labels()).toEqual([]);
    expect(history.undoTitle).toBeUndefined();

    await history.redo();
    await history.redo();
    await history.redo();
    expect(layer.labels()).toEqual([]);
    await history.undo();
    expect(layer.labels()).toEqual(['sofa']);
  });

  it('does not undo an edit if somebody else has changed the object since, and drops the step', async () => {
    const { layer, history, id } = await drawn('chair');
    const others = { layer: 'objects', id, version: layer.get(id).version, object: named('bench') };
    await layer.apply(others);
    await expect(history.undo()).rejects.toThrow('another version');
    expect(layer.labels()).toEqual(['bench']);
    expect(history.undoTitle).toBeUndefined();
  });

  it('can undo an edit after the server was unreachable', async () => {
    const { layer, history } = await drawn('chair');
    layer.reachable = false;
    await expect(history.undo()).rejects.toThrow('not reached');
    layer.reachable = true;
    await history.undo();
    expect(layer.labels()).toEqual([]);
  });

  it('edits and undoes an object that somebody else has changed before', async () => {
    const { layer, history, id } = await drawn('chair');
    const others = { layer: 'objects', id, version: layer.get(id).version, object: named('bench') };
    await layer.apply(others);
    const bench = layer.get(id);
    await history.do({ title: 'relabel', layer: 'objects', before: bench, after: named('sofa') });
    await history.undo();
    expect(layer.labels()).toEqual([bench.label]);
  });

  it('has nothing to redo after a new edit', async () => {
    const { history } = await drawn('chair');
    await history.undo();
    await history.do({ title: 'draw', layer: 'objects', before: undefined, after: named('cup') });
    expect(history.redoTitle).toBeUndefined();
    expect(await history.redo()).toBeUndefined();
  });

  it('does not record a rejected edit', async () => {
    const history = new EditHistory(() => Promise.reject(new Error('no such layer')));
    const edit = { title: 'draw', layer: 'nowhere', before: undefined, after: named('cup') };
    await expect(history.do(edit)).rejects.toThrow('no such layer');
    expect(history.undoTitle).toBeUndefined();
  });
});
