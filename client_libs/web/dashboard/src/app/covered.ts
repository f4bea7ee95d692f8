import type { RefObject } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { mapPadding, type Sides } from '../map/padding';

type Side = 'top' | 'right' | 'bottom' | 'left';

/** How far an element reaches from a side into the map, pixels. */
function reach(element: Element, side: Side): number {
  const { top, right, bottom, left } = element.getBoundingClientRect();
  return { top: bottom, right: innerWidth - left, bottom: innerHeight - top, left: right }[side];
}

function measure(cover: Element): void {
  const at = (side: Side): number => {
    const element = cover.querySelector(`[data-covers="${side}"]`);
    return element ? reach(element, side) : 0;
  };
  const sides: Sides = [at('top'), at('right'), at('bottom'), at('left')];
  // Not all that changes its size covers more or less.
  if (sides.some((size, i) => size !== mapPadding.peek()[i])) mapPadding.value = sides;
}

/** Tells the map how much of it the elements cover that say so by data-covers. */
export function useCover(): RefObject<HTMLDivElement | null> {
  const cover = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const { current } = cover;
    if (!current) return undefined;
    const observer = new ResizeObserver(() => measure(current));
    observer.observe(current);
    for (const element of current.querySelectorAll('[data-covers]')) observer.observe(element);
    return () => observer.disconnect();
  }, []);
  return cover;
}
