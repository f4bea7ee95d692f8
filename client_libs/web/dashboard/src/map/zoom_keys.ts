import Interaction from 'ol/interaction/Interaction';
import { zoomBy } from './zoom';

const STEPS: Readonly<Record<string, number>> = { '+': 1, '-': -1 };

/**
 * Zooms by one level with the keys + and - while the map has the focus. OpenLayers' own interaction
 * starts each step from the painted level, so that quick steps do not add up.
 */
export function zoomKeys(): Interaction {
  return new Interaction({
    handleEvent: ({ type, originalEvent, map }) => {
      if (type !== 'keydown' || !(originalEvent instanceof KeyboardEvent)) return true;
      const { key, ctrlKey, metaKey, altKey } = originalEvent;
      const steps = STEPS[key];
      if (steps === undefined || ctrlKey || metaKey || altKey) return true;
      zoomBy(map.getView(), steps);
      originalEvent.preventDefault();
      return false;
    },
  });
}
