import { resolution } from '../map/resolution';
import { scale } from '../map/scale';
import { formatLength, roundLength } from './lengths';
import './scale_line.css';

/**
 * The maximum length of the line, pixels before scaling for large screens: the width of the tabs.
 */
const LONGEST = 70;

/** The scale bar of the map. Hidden from screen readers, which can't use it. */
export function ScaleLine() {
  const length = roundLength(LONGEST * scale.value * resolution.value);
  return (
    <div class="scale-line" style={{ width: `${length / resolution.value}px` }} aria-hidden="true">
      {formatLength(length)}
    </div>
  );
}
