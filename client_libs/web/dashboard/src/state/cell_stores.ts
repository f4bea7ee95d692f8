import { GridStore } from './grid_store';
import type { CellRuns, GridGeometry } from './model';

function isSame(a: GridGeometry, b: GridGeometry): boolean {
  const [from, to] = [a.origin, b.origin];
  return (
    a.resolutionM === b.resolutionM &&
    from?.x === to?.x &&
    from?.y === to?.y &&
    from?.yaw === to?.yaw
  );
}

/** Returns a store for each distinct grid. Every given cell has the value 1, unknown cells too. */
export function cellStores(cells: readonly CellRuns[]): GridStore[] {
  const stores: GridStore[] = [];
  for (const runs of cells) {
    const { grid } = runs;
    if (!grid) continue;
    let store = stores.find(({ geometry }) => geometry && isSame(geometry, grid));
    if (!store) stores.push((store = new GridStore()));
    store.write({ ...runs, values: runs.rows.map(() => 1) });
  }
  return stores;
}
