import { signal } from '@preact/signals';
import type View from 'ol/View';

export type Sides = readonly [top: number, right: number, bottom: number, left: number];

/** How much of the map other things cover, pixels. */
export const mapPadding = signal<Sides>([0, 0, 0, 0]);

/** So much of the map counts as uncovered at least, whatever lies over it. */
const LEAST_SHARE = 0.2;

/** Both sides of an axis together leave that share of it. */
function limit(low: number, high: number, size: number): [number, number] {
  const part = Math.min(1, ((1 - LEAST_SHARE) * size) / Math.max(1, low + high));
  return [low * part, high * part];
}

/** Makes the middle of what is uncovered the view's centre. Nothing moves on the screen. */
export function pad(view: View, [top, right, bottom, left]: Sides, size: readonly number[]): void {
  const [width = 0, height = 0] = size;
  const [up, down] = limit(top, bottom, height);
  const [west, east] = limit(left, right, width);
  view.padding = [up, east, down, west];
}
