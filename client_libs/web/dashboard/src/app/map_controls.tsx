import { fitAll, zoomBy } from '../map/controls';
import { FitIcon, MinusIcon, PlusIcon } from '../panels/kit/icons';

/** The buttons that zoom in, zoom out and show the whole map. */
export function MapControls() {
  return (
    <section class="card map-controls" aria-label="Zoom">
      <button class="bare" aria-label="Zoom in" title="Zoom in (+)" onClick={() => zoomBy(1)}>
        <PlusIcon />
      </button>
      <button class="bare" aria-label="Zoom out" title="Zoom out (-)" onClick={() => zoomBy(-1)}>
        <MinusIcon />
      </button>
      <button class="bare" aria-label="Show all" title="Show all (0)" onClick={fitAll}>
        <FitIcon />
      </button>
    </section>
  );
}
