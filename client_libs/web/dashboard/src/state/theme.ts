import { signal } from '@preact/signals';

const query = matchMedia('(prefers-color-scheme: dark)');

/** Whether the page is dark, following the system's colour scheme. */
export const dark = signal(query.matches);

query.addEventListener('change', (event) => (dark.value = event.matches));
