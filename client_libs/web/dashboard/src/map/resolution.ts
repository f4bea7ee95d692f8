import { signal } from '@preact/signals';

/** The current resolution of the map, metres per pixel. */
export const resolution = signal(0.05);
