import { signal } from '@preact/signals';

/** The root font size at which drawings are not scaled, pixels. */
const PLAIN = 16;

function read(): number {
  return parseFloat(getComputedStyle(document.documentElement).fontSize) / PLAIN;
}

/** The scale of drawings, greater than 1 on large screens, as theme.css sets the root font size. */
export const scale = signal(read());

addEventListener('resize', () => (scale.value = read()));
