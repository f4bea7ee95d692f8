// The most recent changes of the shown map.
import { signal } from '@preact/signals';
import { ChangeKind, type Change } from './model';

/** The number of changes that are kept for the list. */
const KEPT = 200;

export interface ChangeEntry {
  /** Unique on this page. */
  key: number;
  revision: bigint;
  time: Date | undefined;
  author: string;
  layer: string;
  kind: ChangeKind;
  /** Undefined when the change is not about an object. */
  objectId: bigint | undefined;
  label: string | undefined;
  /** Whether the change created the object. */
  isNew: boolean;
  /** The number of cells that were written. */
  cells: number;
}

/** Changes since the page was opened, newest first. */
export const changes = signal<readonly ChangeEntry[]>([]);

let nextKey = 0;

function cellCount(change: Change): number {
  const runs = change.cells;
  if (!runs) return 0;
  return runs.colEnds.reduce((sum, end, i) => sum + end - (runs.colBegins[i] ?? end), 0);
}

export interface Commit {
  revision: bigint;
  time: Date | undefined;
  author: string;
}

/** Adds the changes of a commit. `labelOf` returns an object's label before the commit. */
export function noteChanges(
  commit: Commit,
  told: readonly Change[],
  labelOf: (id: bigint) => string | undefined,
): void {
  const entries = told.slice(-KEPT).map((change): ChangeEntry => {
    const isObject = change.objectId !== 0n;
    const labelBefore = labelOf(change.objectId);
    return {
      ...commit,
      key: nextKey++,
      layer: change.layer,
      kind: change.kind,
      objectId: isObject ? change.objectId : undefined,
      label: isObject ? (change.object?.label ?? labelBefore) : undefined,
      isNew: isObject && labelBefore === undefined,
      cells: cellCount(change),
    };
  });
  changes.value = [...entries.reverse(), ...changes.value].slice(0, KEPT);
}

export function forgetChanges(): void {
  changes.value = [];
}
