import { computed } from '@preact/signals';
import { scale } from '../map/scale';
import { panels } from '../panels';
import { activePanel } from '../panels/active';
import { wide } from './wide';

type Sides = readonly [top: number, right: number, bottom: number, left: number];

// As layout.css has them.
const WIDE: Sides = [32, 100, 110, 340];
const NARROW: Sides = [80, 24, 100, 24];
const PANEL_WIDTH = 352;
const SHEET_SHARE = 0.45;

/** How much of the map the layout covers with the panel that is open, pixels. */
export const covered = computed((): Sides => {
  const open = panels.find(({ id }) => id === activePanel.value);
  const [top, right, bottom, left] = wide.value ? WIDE : NARROW;
  const s = scale.value;
  if (!wide.value) return [top, right, bottom + (open ? SHEET_SHARE * innerHeight : 0), left];
  return [top * s, (right + (open?.place === 'right' ? PANEL_WIDTH : 0)) * s, bottom * s, left * s];
});
