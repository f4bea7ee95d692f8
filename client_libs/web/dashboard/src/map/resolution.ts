import { signal } from '@preact/signals';

/** Of the map as it is painted now, metres a pixel. */
export const resolution = signal(0.05);
