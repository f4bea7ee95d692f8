// The selected object, the marked results of a question and the requested view.
import { computed, signal } from '@preact/signals';
import type { CellRuns, Position } from './model';
import { shown } from './time';

/** The id of the object whose card is shown. */
export const selectedId = signal<bigint>();

/** The selected object at the shown revision. Undefined if the map does not have it there. */
export const selected = computed(() => {
  const content = shown.value;
  content.revision.value; // Recomputed after each commit.
  return selectedId.value === undefined ? undefined : content.find(selectedId.value);
});

/** The results of a question that the map marks. */
export interface Highlight {
  objectIds: readonly bigint[];
  cells: readonly CellRuns[];
  /** The closed ring of the area that the question is about. */
  area?: Position[] | undefined;
  /** The point that the question is about. */
  point?: Position | undefined;
}

export const NO_HIGHLIGHT: Highlight = { objectIds: [], cells: [] };
export const highlight = signal<Highlight>(NO_HIGHLIGHT);

/** The box that the map should move to, metres: min x, min y, max x, max y. */
export const wantedView = signal<{ box: [number, number, number, number] }>();

/** Moves the map to a box. */
export function lookAt(box: [number, number, number, number]): void {
  wantedView.value = { box };
}
