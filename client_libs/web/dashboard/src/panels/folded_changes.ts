import type { ChangeEntry } from '../state/changes';
import { ChangeKind } from '../state/model';

/** Changes of the same kind to the same thing, one soon after the other. */
export interface FoldedChange {
  /** The last one. */
  newest: ChangeEntry;
  times: number;
  /** Written in all of them. */
  cells: number;
}

const SOON_MS = 10_000;

function sameThing(a: ChangeEntry, b: ChangeEntry): boolean {
  return a.layer === b.layer && a.kind === b.kind && a.objectId === b.objectId;
}

function soonAfter(later: ChangeEntry, earlier: ChangeEntry): boolean {
  if (!later.time || !earlier.time) return true;
  return later.time.getTime() - earlier.time.getTime() < SOON_MS;
}

/** What robots do many times a second becomes one line. The newest first, as it came. */
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

/** What happened, in a word. */
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
