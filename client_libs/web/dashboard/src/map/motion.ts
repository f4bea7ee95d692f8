const reduced = matchMedia('(prefers-reduced-motion: reduce)');

/** The duration of animated moves, milliseconds; 0 if the user prefers reduced motion. */
export function moveMs(): number {
  return reduced.matches ? 0 : 200;
}

let moves = 0;

/** Whether the page is moving the map to a target. False while the user moves it. */
export function isPageMoving(): boolean {
  return moves > 0;
}

/**
 * Counts a move of the page. The returned function must be called when it has ended or was
 * cancelled.
 */
export function beginMove(): () => void {
  moves += 1;
  return () => {
    moves -= 1;
  };
}
