import { keepShape, reshaping, startReshaping } from '../map/reshape';
import { cancelTool } from '../map/tools';
import { may } from '../state/caller';
import { editing, pinObject, PINNED, removeObject } from '../state/edits';
import type { Object$ } from '../state/model';
import { asOf } from '../state/time';

interface Props {
  layer: string;
  object: Object$;
}

/** Buttons that change an object of the live map, for callers who may. */
export function ObjectActions({ layer, object }: Props) {
  if (!may('EditService/ApplyEdits')) return null;
  if (asOf.value !== undefined) return <p class="note">Earlier revisions can't be changed.</p>;
  if (reshaping.value?.before.id === object.id) return <ReshapingActions />;
  const busy = editing.value;
  const pinned = object.tags.includes(PINNED);
  return (
    <div class="row actions" role="group" aria-label={`Change ${object.label}`}>
      <button disabled={busy} onClick={() => startReshaping(layer, object)}>
        Edit shape
      </button>
      <button
        disabled={busy || pinned}
        title="Confirms the object, so that fusion no longer changes it"
        onClick={() => void pinObject(layer, object)}
      >
        {pinned ? 'Pinned' : 'Pin'}
      </button>
      <button class="danger" disabled={busy} onClick={() => void removeObject(layer, object)}>
        Delete
      </button>
    </div>
  );
}

function ReshapingActions() {
  return (
    <div class="row actions" role="group" aria-label="Shape">
      <button class="primary" onClick={() => void keepShape()}>
        Keep shape
      </button>
      <button onClick={cancelTool}>Cancel</button>
    </div>
  );
}
