import { resolution } from '../map/resolution';
import { scale } from '../map/scale';
import { formatLength, roundLength } from './lengths';
import './scale_line.css';

/** The line is at most so long, pixels: as wide as the tabs above it. */
const LONGEST = 70;

/** How long things on the map are, for those who see it. */
export function ScaleLine() {
  const metresPerPixel = resolution.value * scale.value;
  const length = roundLength(LONGEST * metresPerPixel);
  return (
    <div class="scale-line" style={{ width: `${length / metresPerPixel}px` }} aria-hidden="true">
      {formatLength(length)}
    </div>
  );
}
