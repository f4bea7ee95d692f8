import { signal } from '@preact/signals';

/** How much of the map other things cover, pixels: top, right, bottom, left. */
export const mapPadding = signal<readonly [number, number, number, number]>([24, 24, 24, 24]);
