import { containsExtent, getHeight, getIntersection, getWidth, type Extent } from 'ol/extent';

/** By how much a span's bounds must move to enclose another span, which is shorter. */
function shift(from: number, to: number, low: number, high: number, margin: number): number {
  const room = Math.min(margin, (high - low - (to - from)) / 2);
  if (from < low + room) return from - (low + room);
  return Math.max(0, to - (high - room));
}

/** Whether a box fits into what is seen, wherever it is. */
export function fitsInto(box: Extent, sight: Extent): boolean {
  return getWidth(box) <= getWidth(sight) && getHeight(box) <= getHeight(sight);
}

/** By how much what is seen must move to have a box in it that fits, with a margin if there is room. */
export function shiftToSee(box: Extent, sight: Extent, margin: number): [number, number] {
  const [minX = 0, minY = 0, maxX = 0, maxY = 0] = box;
  const [left = 0, bottom = 0, right = 0, top = 0] = sight;
  return [shift(minX, maxX, left, right, margin), shift(minY, maxY, bottom, top, margin)];
}

/** How much of a box is not seen, in [0, 1]. */
export function hiddenShare(box: Extent, sight: Extent): number {
  if (containsExtent(sight, box)) return 0;
  const seen = getIntersection(box, sight);
  const share = (part: number, whole: number) => (whole > 0 ? Math.max(0, part) / whole : 1);
  return 1 - share(getWidth(seen), getWidth(box)) * share(getHeight(seen), getHeight(box));
}
