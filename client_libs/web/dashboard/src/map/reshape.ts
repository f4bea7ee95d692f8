// Editing the shape of an object with the pointer.
import { signal } from '@preact/signals';
import { editObject } from '../state/edits';
import type { Object$ } from '../state/model';
import { kindOf, type KindOfShape } from '../state/shapes';
import { geometryOf } from './geometry';
import { modifyShape, type Modification } from './tools';

interface Reshaping {
  layer: string;
  before: Object$;
  modification: Modification;
}

/** The shape that is being edited. Undefined if there is none. */
export const reshaping = signal<Reshaping>();

function hintFor(kind: KindOfShape, label: string): string {
  switch (kind) {
    case 'polygon':
      return `Drag corners or edges of the ${label}; Alt+click removes a corner`;
    case 'lineString':
      return `Drag vertices or segments of the ${label}; Alt+click removes a vertex`;
    case 'point':
      return `Drag the ${label} to its new place`;
  }
}

/** Lets the user edit the shape of an object until they keep it or cancel. */
export function startReshaping(layer: string, before: Object$): void {
  const [kind, geometry] = [kindOf(before), geometryOf(before.shape)];
  if (!kind || !geometry) return;
  const onEnd = () => (reshaping.value = undefined);
  const modification = modifyShape(geometry, hintFor(kind, before.label), onEnd);
  reshaping.value = { layer, before, modification };
}

/** Ends the editing and sends the new shape to the server. */
export async function keepShape(): Promise<void> {
  if (!reshaping.value) return;
  const { layer, before, modification } = reshaping.value;
  const after = { ...before, shape: modification.shape() };
  modification.end();
  await editObject({ title: `reshape ${before.label}`, layer, before, after });
}
