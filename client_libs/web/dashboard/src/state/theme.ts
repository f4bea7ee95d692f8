import { signal } from '@preact/signals';

const query = matchMedia('(prefers-color-scheme: dark)');

/** Whether the page is dark, as the system wants it. */
export const dark = signal(query.matches);

query.addEventListener('change', (event) => (dark.value = event.matches));
