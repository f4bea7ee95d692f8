import { redo, removeObject, undo } from '../state/edits';
import { selected } from '../state/selection';
import { asOf } from '../state/time';
import { addShortcut } from './kit/shortcuts';

function removeSelected(): void {
  if (asOf.value !== undefined || !selected.value) return;
  const { layer, object } = selected.value;
  void removeObject(layer, object);
}

/** Adds the shortcuts for edits, which work whichever panel is open. */
export function addEditKeys(): () => void {
  const stops = [
    addShortcut({ key: 'mod+z', what: 'Undo', act: () => void undo() }),
    addShortcut({ key: 'mod+y', what: 'Redo', act: () => void redo() }),
    addShortcut({ key: 'Delete', what: 'Delete the selected object', act: removeSelected }),
  ];
  return () => stops.forEach((stop) => stop());
}
