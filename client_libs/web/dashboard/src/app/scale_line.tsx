import { resolution } from '../map/resolution';
import { scale } from '../map/scale';
import { formatLength, roundLength } from './lengths';
import './scale_line.css';

/** The line is at most so long, pixels that grow with the screen: as wide as the tabs above it. */
const LONGEST = 70;

/** How long things on the map are, for those who see it. */
export function ScaleLine() {
  const length = roundLength(LONGEST * scale.value * resolution.value);
  return (
    <div class="scale-line" style={{ width: `${length / resolution.value}px` }} aria-hidden="true">
      {formatLength(length)}
    </div>
  );
}
