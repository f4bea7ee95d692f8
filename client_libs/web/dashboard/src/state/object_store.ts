import { signal } from '@preact/signals';
import type { Object$ } from './model';

/** The changes of one step. An object that was removed and put again is in `put` only. */
export interface ObjectDelta {
  put: ReadonlyMap<bigint, Object$>;
  removed: ReadonlySet<bigint>;
}

/** The objects of one semantic layer, by id, in the map's own frame. */
export class ObjectStore {
  readonly type = 'objects';
  readonly objects = new Map<bigint, Object$>();
  /** Counts the steps. Effects that read it run after each step. */
  readonly version = signal(0);

  #put = new Map<bigint, Object$>();
  #removed = new Set<bigint>();
  readonly #listeners = new Set<(delta: ObjectDelta) => void>();

  put(object: Object$): void {
    this.objects.set(object.id, object);
    this.#put.set(object.id, object);
    this.#removed.delete(object.id);
  }

  remove(id: bigint): void {
    if (!this.objects.delete(id)) return;
    this.#put.delete(id);
    this.#removed.add(id);
  }

  /** Notifies listeners of the objects that were put and removed since the last step. */
  step(): void {
    if (this.#put.size + this.#removed.size === 0) return;
    const delta = { put: this.#put, removed: this.#removed };
    this.#put = new Map();
    this.#removed = new Set();
    this.version.value++;
    for (const listener of this.#listeners) listener(delta);
  }

  onStep(listener: (delta: ObjectDelta) => void): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }
}
