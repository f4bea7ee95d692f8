// Editing the shape of an object with the pointer.
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

/** The shape that is being edited. Undefined if there is none. */
export const reshaping = signal<Reshaping>();

/** Lets the user edit the shape of an object until they keep it or cancel. */
export function startReshaping(layer: string, before: Object$): void {
  if (!before.polygon) return;
  const hint = `Drag corners or edges of the ${before.label}; Alt+click removes a corner`;
  const onEnd = () => (reshaping.value = undefined);
  const modification = modifyPolygon(ringsOf(before.polygon), hint, onEnd);
  reshaping.value = { layer, before, modification };
}

/** Ends the editing and sends the new shape to the server. */
export async function keepShape(): Promise<void> {
  if (!reshaping.value) return;
  const { layer, before, modification } = reshaping.value;
  const after = { ...before, polygon: polygonOf(modification.rings()) };
  modification.end();
  await editObject({ title: `reshape ${before.label}`, layer, before, after });
}
