import { computed, signal } from '@preact/signals';

function matches(query: string) {
  const list = matchMedia(query);
  const matching = signal(list.matches);
  list.addEventListener('change', (event) => (matching.value = event.matches));
  return matching;
}

const large = matches('(min-width: 2200px)');
const huge = matches('(min-width: 3400px)');

/** How much larger all is drawn on screens that are read from afar. */
export const scale = computed(() => (huge.value ? 2 : large.value ? 1.35 : 1));
