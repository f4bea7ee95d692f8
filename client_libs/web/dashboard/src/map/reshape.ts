// An object's shape in people's hands.
import { signal } from '@preact/signals';
import { editObject } from '../state/edits';
import { ringsOf, type Object$ } from '../state/model';
import { polygonOf } from '../state/objects';
import { modifyPolygon, type Modification } from './tools';

interface Reshaping {
  layer: string;
  before: Object$;
  modification: Modification;
}

/** Undefined while no shape is changed. */
export const reshaping = signal<Reshaping>();

/** Lets people change the shape of an object, until they keep it or put it down. */
export function startReshaping(layer: string, before: Object$): void {
  if (!before.polygon) return;
  const hint = `Drag corners or edges of the ${before.label}; Alt and a click remove a corner`;
  const onEnd = () => (reshaping.value = undefined);
  const modification = modifyPolygon(ringsOf(before.polygon), hint, onEnd);
  reshaping.value = { layer, before, modification };
}

/** Sends the shape as it is now to the server. */
export async function keepShape(): Promise<void> {
  if (!reshaping.value) return;
  const { layer, before, modification } = reshaping.value;
  const after = { ...before, polygon: polygonOf(modification.rings()) };
  modification.end();
  await editObject({ title: `reshape ${before.label}`, layer, before, after });
}
