const reduced = matchMedia('(prefers-reduced-motion: reduce)');

/** How long the map is on its way, milliseconds; people may not want to see it move. */
export function moveMs(): number {
  return reduced.matches ? 0 : 200;
}
