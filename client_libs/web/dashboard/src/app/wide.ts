import { signal } from '@preact/signals';

const query = matchMedia('(min-width: 66.25em)');

/** Whether there is room for panels at the sides of the map; otherwise they are a sheet below. */
export const wide = signal(query.matches);

query.addEventListener('change', (event) => (wide.value = event.matches));
