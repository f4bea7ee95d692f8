import { signal } from '@preact/signals';

/** The size of the root's letters where all is drawn as large as it is, pixels. */
const PLAIN = 16;

function read(): number {
  return parseFloat(getComputedStyle(document.documentElement).fontSize) / PLAIN;
}

/** How much larger all is drawn on screens that are read from afar: theme.css decides. */
export const scale = signal(read());

addEventListener('resize', () => (scale.value = read()));
