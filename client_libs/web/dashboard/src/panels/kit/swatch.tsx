import { classColour, css } from '../../map/colours';
import type { Object$ } from '../../state/model';
import { kindOf } from '../../state/shapes';
import { dark } from '../../state/theme';
import { shapeWord } from '../../state/words';

/** The colour of an object's class in the form of its shape: an area, a line or a point. */
export function Swatch({ object }: { object: Object$ }) {
  const kind = kindOf(object);
  const colour = css(classColour(object.label, dark.value));
  return <span class={`swatch ${kind ? shapeWord(kind) : ''}`} style={{ background: colour }} />;
}
