// What people picked out: one object, and the answers of a question.
import { computed, signal } from '@preact/signals';
import type { CellRuns, Position } from './model';
import { shown } from './time';

/** The id of the object whose card is shown. */
export const selectedId = signal<bigint>();

/** The object as it is on the map now (or as of the shown time), if it is there. */
export const selected = computed(() => {
  const content = shown.value;
  content.revision.value; // again after each step
  return selectedId.value === undefined ? undefined : content.find(selectedId.value);
});

/** Places that the map marks: answers of a question. */
export interface Highlight {
  objectIds: readonly bigint[];
  cells: readonly CellRuns[];
  /** The area that was asked about, closed. */
  area?: Position[] | undefined;
  /** The point that was asked about. */
  point?: Position | undefined;
}

export const NO_HIGHLIGHT: Highlight = { objectIds: [], cells: [] };
export const highlight = signal<Highlight>(NO_HIGHLIGHT);

/** A place that the map should move to: a point, or a box. */
export const wantedView = signal<{ box: [number, number, number, number] }>();

/** Moves the map to a box, metres: min x, min y, max x, max y. */
export function lookAt(box: [number, number, number, number]): void {
  wantedView.value = { box };
}
