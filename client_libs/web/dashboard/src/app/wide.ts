import { signal } from '@preact/signals';

const query = matchMedia('(min-width: 66.25em)');

/**
 * Whether there is room for panels beside the map. Otherwise they open as a sheet at the bottom.
 */
export const wide = signal(query.matches);

query.addEventListener('change', (event) => (wide.value = event.matches));
