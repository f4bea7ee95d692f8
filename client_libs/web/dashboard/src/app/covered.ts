import type { RefObject } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { mapPadding, type Sides } from '../map/padding';

type Side = 'top' | 'right' | 'bottom' | 'left';

/** The distance from a side of the window to the far edge of an element, pixels. */
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
  // An element may change its size without covering more or less of the map.
  if (sides.some((size, i) => size !== mapPadding.peek()[i])) mapPadding.value = sides;
}

/** Keeps `mapPadding` up to date with the elements in the returned one that have `data-covers`. */
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
