import { signal, useSignal } from '@preact/signals';
import { middle } from '../map/controls';
import { drawShape } from '../map/tools';
import { editing, editObject, redo, redoTitle, undo, undoTitle } from '../state/edits';
import type { Object$, Shape } from '../state/model';
import {
  drawableLayers,
  drawnObject,
  kindsTakenBy,
  knownLabels,
  smallShapeAt,
} from '../state/objects';
import { selected } from '../state/selection';
import type { KindOfShape } from '../state/shapes';
import { asOf, backToLive } from '../state/time';
import { EditIcon } from './kit/icons';
import { ObjectActions } from './object_actions';
import './edit_panel.css';
import type { Panel } from './panel';

const label = signal('');
const wantedLayer = signal<string>();
const wantedKind = signal<KindOfShape>('polygon');

function layerToDrawOn(): string | undefined {
  const names = drawableLayers.value;
  return names.find((name) => name === wantedLayer.value) ?? names[0];
}

/** The kind of shape to draw: the wanted one if the layer takes it. */
function kindToDraw(layer: string): KindOfShape | undefined {
  const kinds = kindsTakenBy(layer);
  return kinds.find((kind) => kind === wantedKind.value) ?? kinds[0];
}

interface KindWords {
  /** The name of the tool. */
  name: string;
  /** The instruction for drawing. */
  hint: (label: string) => string;
  /** The button that places a small shape, and its explanation. */
  place: string;
  placed: string;
}

const KIND_WORDS: Record<KindOfShape, KindWords> = {
  polygon: {
    name: 'Polygon',
    hint: (what) => `Click the corners of the ${what}; click the last one twice`,
    place: 'Place a square',
    placed: 'Half a metre wide, at the centre of the map',
  },
  lineString: {
    name: 'Line',
    hint: (what) => `Click the vertices of the ${what}; click the last one twice`,
    place: 'Place a line',
    placed: 'A metre long, at the centre of the map',
  },
  point: {
    name: 'Point',
    hint: (what) => `Click the place of the ${what}`,
    place: 'Place a point',
    placed: 'At the centre of the map',
  },
};

async function put(layer: string, shape: Shape | undefined): Promise<void> {
  if (!shape) return;
  const after = drawnObject(label.value.trim(), shape);
  await editObject({ title: `draw ${after.label}`, layer, before: undefined, after });
}

async function draw(layer: string, kind: KindOfShape): Promise<void> {
  await put(layer, await drawShape(kind, KIND_WORDS[kind].hint(label.value)));
}

/** Puts a small shape at the centre of the map, for users who can't draw with a pointer. */
async function place(layer: string, kind: KindOfShape): Promise<void> {
  const at = middle();
  if (at) await put(layer, smallShapeAt(at, kind));
}

/** The choice of what to draw. A layer that takes one kind of shape leaves none. */
function KindChoice({ layer, kind }: { layer: string; kind: KindOfShape }) {
  const kinds = kindsTakenBy(layer);
  if (kinds.length < 2) return null;
  return (
    <div class="segments" role="group" aria-label="Shape to draw">
      {kinds.map((each) => (
        <button
          key={each}
          type="button"
          aria-pressed={each === kind}
          onClick={() => (wantedKind.value = each)}
        >
          {KIND_WORDS[each].name}
        </button>
      ))}
    </div>
  );
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
  const kind = kindToDraw(layer);
  if (!kind) return <p class="note">This page can't draw the shapes of layer {layer}.</p>;
  const onSubmit = (event: SubmitEvent) => {
    event.preventDefault();
    const isPlaced = event.submitter?.getAttribute('name') === 'place';
    void (isPlaced ? place(layer, kind) : draw(layer, kind));
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
      <KindChoice layer={layer} kind={kind} />
      <div class="row actions">
        <button class="primary" disabled={editing.value}>
          Draw
        </button>
        <button name="place" disabled={editing.value} title={KIND_WORDS[kind].placed}>
          {KIND_WORDS[kind].place}
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
  needs: 'EditService/ApplyEdits',
};
