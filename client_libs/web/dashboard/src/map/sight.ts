import { containsExtent, getHeight, getIntersection, getWidth, type Extent } from 'ol/extent';

/** Returns how far the span [low, high] must move to enclose the shorter span [from, to]. */
function shift(from: number, to: number, low: number, high: number, margin: number): number {
  const room = Math.min(margin, (high - low - (to - from)) / 2);
  if (from < low + room) return from - (low + room);
  return Math.max(0, to - (high - room));
}

/** Whether a box is small enough to fit into the visible extent. */
export function fitsInto(box: Extent, sight: Extent): boolean {
  return getWidth(box) <= getWidth(sight) && getHeight(box) <= getHeight(sight);
}

/**
 * Returns how far the visible extent must move to contain a box, with a margin if there is room.
 */
export function shiftToSee(box: Extent, sight: Extent, margin: number): [number, number] {
  const [minX = 0, minY = 0, maxX = 0, maxY = 0] = box;
  const [left = 0, bottom = 0, right = 0, top = 0] = sight;
  return [shift(minX, maxX, left, right, margin), shift(minY, maxY, bottom, top, margin)];
}

/** The share of a box outside of the visible extent, in [0, 1]. */
export function hiddenShare(box: Extent, sight: Extent): number {
  if (containsExtent(sight, box)) return 0;
  const seen = getIntersection(box, sight);
  const share = (part: number, whole: number) => (whole > 0 ? Math.max(0, part) / whole : 1);
  return 1 - share(getWidth(seen), getWidth(box)) * share(getHeight(seen), getHeight(box));
}
