import type { ChangeEntry } from '../state/changes';
import { ChangeKind } from '../state/model';

/** Consecutive changes of the same kind to the same object or layer within a short time. */
export interface FoldedChange {
  /** The most recent of these changes. */
  newest: ChangeEntry;
  /** The number of changes. */
  times: number;
  /** The number of cells written by all of them. */
  cells: number;
}

/** The longest time between two changes that are listed as one. */
const SOON_MS = 10_000;

function sameThing(a: ChangeEntry, b: ChangeEntry): boolean {
  return a.layer === b.layer && a.kind === b.kind && a.objectId === b.objectId;
}

function soonAfter(later: ChangeEntry, earlier: ChangeEntry): boolean {
  if (!later.time || !earlier.time) return true;
  return later.time.getTime() - earlier.time.getTime() < SOON_MS;
}

/**
 * Joins repeated changes, which robots may make many times per second, into one line each. Expects
 * the newest change first, and returns the same order.
 */
export function foldChanges(entries: readonly ChangeEntry[]): FoldedChange[] {
  const folded: FoldedChange[] = [];
  for (const entry of entries) {
    const open = folded.find(({ newest }) => !entry.isNew && sameThing(newest, entry));
    if (open && soonAfter(open.newest, entry)) {
      open.times++;
      open.cells += entry.cells;
    } else {
      folded.push({ newest: entry, times: 1, cells: entry.cells });
    }
  }
  return folded;
}

/** The kind of a change as a word. */
export function verbOf({ kind, isNew }: ChangeEntry): string {
  switch (kind) {
    case ChangeKind.PUT:
      return isNew ? 'added' : 'changed';
    case ChangeKind.REMOVE:
      return 'removed';
    case ChangeKind.CELLS:
      return 'written';
    case ChangeKind.LAYER_CREATED:
      return 'layer created';
    case ChangeKind.LAYER_DELETED:
      return 'layer deleted';
    case ChangeKind.LAYER_CHANGED:
      return 'layer changed';
    case ChangeKind.TRANSFORM:
      return 'frame moved';
    default:
      return 'changed';
  }
}
