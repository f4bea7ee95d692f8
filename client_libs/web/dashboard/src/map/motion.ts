const reduced = matchMedia('(prefers-reduced-motion: reduce)');

/** How long the map is on its way, milliseconds; people may not want to see it move. */
export function moveMs(): number {
  return reduced.matches ? 0 : 200;
}

let moves = 0;

/** Whether the map is on its way to what it is to show. Not when people move it. */
export function isOnItsWay(): boolean {
  return moves > 0;
}

/** A move begins. Returns what is to be called when it has ended, or was cut short. */
export function setOut(): () => void {
  moves += 1;
  return () => {
    moves -= 1;
  };
}
