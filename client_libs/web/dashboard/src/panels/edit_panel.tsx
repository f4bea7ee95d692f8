import { signal, useSignal } from '@preact/signals';
import { middle } from '../map/controls';
import { drawPolygon } from '../map/tools';
import { editing, editObject, redo, redoTitle, undo, undoTitle } from '../state/edits';
import type { Object$, Position } from '../state/model';
import { drawableLayers, drawnObject, knownLabels, squareAround } from '../state/objects';
import { selected } from '../state/selection';
import { asOf, backToLive } from '../state/time';
import { EditIcon } from './kit/icons';
import { ObjectActions } from './object_actions';
import './edit_panel.css';
import type { Panel } from './panel';

const label = signal('');
const wantedLayer = signal<string>();

function layerToDrawOn(): string | undefined {
  const names = drawableLayers.value;
  return names.find((name) => name === wantedLayer.value) ?? names[0];
}

async function put(ring: Position[] | undefined): Promise<void> {
  const layer = layerToDrawOn();
  if (!ring || !layer) return;
  const after = drawnObject(label.value.trim(), ring);
  await editObject({ title: `draw ${after.label}`, layer, before: undefined, after });
}

async function draw(): Promise<void> {
  await put(await drawPolygon(`Click the corners of the ${label.value}; click the last one twice`));
}

/** Puts a square at the centre of the map, for users who can't draw with a pointer. */
async function placeSquare(): Promise<void> {
  const at = middle();
  if (at) await put(squareAround(at, 0.5));
}

function LabelField({ value, onInput }: { value: string; onInput: (text: string) => void }) {
  return (
    <label class="field">
      Class
      <input
        type="text"
        list="known-labels"
        required
        pattern=".*\S.*"
        placeholder="chair"
        autocomplete="off"
        value={value}
        onInput={(event) => onInput(event.currentTarget.value)}
      />
    </label>
  );
}

function NewObject() {
  const layer = layerToDrawOn();
  if (!layer) return <p class="note">This map has no layer of objects to draw on.</p>;
  const onSubmit = (event: SubmitEvent) => {
    event.preventDefault();
    const square = event.submitter?.getAttribute('name') === 'square';
    void (square ? placeSquare() : draw());
  };
  return (
    <form class="stack" aria-label="New object" onSubmit={onSubmit}>
      <h3>New object</h3>
      <div class="row fields">
        <LabelField value={label.value} onInput={(text) => (label.value = text)} />
        <label class="field">
          Layer
          <select value={layer} onChange={(e) => (wantedLayer.value = e.currentTarget.value)}>
            {drawableLayers.value.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
      </div>
      <div class="row actions">
        <button class="primary" disabled={editing.value}>
          Draw
        </button>
        <button
          name="square"
          disabled={editing.value}
          title="Half a metre wide, at the centre of the map"
        >
          Place a square
        </button>
      </div>
    </form>
  );
}

interface SelectedProps {
  layer: string;
  object: Object$;
}

function SelectedObject({ layer, object }: SelectedProps) {
  const name = useSignal(object.label);
  const rename = (event: SubmitEvent) => {
    event.preventDefault();
    const after = { ...object, label: name.value.trim(), classes: {} };
    if (after.label === object.label) return;
    void editObject({
      title: `rename ${object.label} to ${after.label}`,
      layer,
      before: object,
      after,
    });
  };
  return (
    <section class="stack" aria-label="Selected object">
      <h3>
        Selected: {object.label} <small>on {layer}</small>
      </h3>
      <form class="row fields" aria-label="Rename" onSubmit={rename}>
        <LabelField value={name.value} onInput={(text) => (name.value = text)} />
        <button disabled={editing.value}>Rename</button>
      </form>
      <ObjectActions layer={layer} object={object} />
    </section>
  );
}

function UndoRedo() {
  return (
    <div class="row actions" role="group" aria-label="History">
      <button
        disabled={editing.value || !undoTitle.value}
        title="Ctrl+Z"
        onClick={() => void undo()}
      >
        {undoTitle.value ? `Undo ${undoTitle.value}` : 'Undo'}
      </button>
      <button
        disabled={editing.value || !redoTitle.value}
        title="Ctrl+Y"
        onClick={() => void redo()}
      >
        {redoTitle.value ? `Redo ${redoTitle.value}` : 'Redo'}
      </button>
    </div>
  );
}

function Edit() {
  if (asOf.value !== undefined) {
    return (
      <div class="stack">
        <p class="note">You are viewing an earlier revision, which can't be changed.</p>
        <button onClick={backToLive}>Back to live</button>
      </div>
    );
  }
  return (
    <div class="stack edit">
      <NewObject />
      {selected.value ? (
        <SelectedObject key={`${selected.value.object.id}`} {...selected.value} />
      ) : (
        <p class="note">Click an object on the map to change it.</p>
      )}
      <UndoRedo />
      <datalist id="known-labels">
        {knownLabels.value.map((known) => (
          <option key={known} value={known} />
        ))}
      </datalist>
    </div>
  );
}

export const editPanel: Panel = {
  id: 'edit',
  title: 'Edit',
  icon: EditIcon,
  component: Edit,
  place: 'right',
  shortcut: 'e',
};
