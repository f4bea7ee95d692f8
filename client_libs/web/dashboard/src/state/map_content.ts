import { signal } from '@preact/signals';
import { GridStore } from './grid_store';
import { AnswerStatus, ChangeKind, type Change, type LayerPart, type Object$ } from './model';
import { ObjectStore } from './object_store';

export type LayerStore = ObjectStore | GridStore;

/** The content of a map's layers at one revision, updated by changes or read once. */
export class MapContent {
  /** The store of each layer by name. A layer that was never written to has none. */
  readonly stores = signal<ReadonlyMap<string, LayerStore>>(new Map());
  readonly revision = signal(0n);

  apply(change: Change): void {
    switch (change.kind) {
      case ChangeKind.PUT:
      case ChangeKind.ENTER:
        if (change.object) this.#objects(change.layer).put(change.object);
        break;
      case ChangeKind.REMOVE:
      case ChangeKind.LEAVE:
        this.#objects(change.layer).remove(change.objectId);
        break;
      case ChangeKind.CELLS:
        if (change.cells) this.#grid(change.layer).write(change.cells);
        break;
      case ChangeKind.LAYER_DELETED:
        this.#drop(change.layer);
        break;
    }
  }

  /** Adds one part of a QueryArea answer. A layer that can't answer has no content. */
  add({ layer, status, objects, cells }: LayerPart): void {
    if (status !== AnswerStatus.VALUE) return;
    // A part of a grid has cells even if it is empty, because the geometry is in them.
    if (cells) {
      this.#grid(layer).write(cells);
      return;
    }
    const store = this.#objects(layer);
    for (const object of objects) store.put(object);
  }

  /** Notifies the listeners of all stores of the changes since the last step. */
  step(revision: bigint): void {
    for (const store of this.stores.value.values()) store.step();
    this.revision.value = revision;
  }

  objects(layer: string): ReadonlyMap<bigint, Object$> {
    const store = this.stores.value.get(layer);
    return store?.type === 'objects' ? store.objects : new Map();
  }

  /** Finds an object by its id on any layer. */
  find(id: bigint): { layer: string; object: Object$ } | undefined {
    for (const [layer, store] of this.stores.value) {
      const object = store.type === 'objects' ? store.objects.get(id) : undefined;
      if (object) return { layer, object };
    }
    return undefined;
  }

  #objects(layer: string): ObjectStore {
    const store = this.stores.value.get(layer);
    return store?.type === 'objects' ? store : this.#add(layer, new ObjectStore());
  }

  #grid(layer: string): GridStore {
    const store = this.stores.value.get(layer);
    return store?.type === 'grid' ? store : this.#add(layer, new GridStore());
  }

  #add<T extends LayerStore>(layer: string, store: T): T {
    this.stores.value = new Map(this.stores.value).set(layer, store);
    return store;
  }

  #drop(layer: string): void {
    const stores = new Map(this.stores.value);
    stores.delete(layer);
    this.stores.value = stores;
  }
}
