import { signal } from '@preact/signals';
import { changes } from '../state/changes';
import { live } from '../state/live';
import { lookAt, selectedId } from '../state/selection';
import { boxOf } from '../state/shapes';
import { showRevision } from '../state/time';
import './changes_panel.css';
import { foldChanges, verbOf, type FoldedChange } from './folded_changes';
import { ChangesIcon } from './kit/icons';
import type { Panel } from './panel';

const onlyLayer = signal('');

function look(id: bigint): void {
  const found = live.value.find(id);
  const box = found && boxOf(found.object);
  selectedId.value = id;
  if (box) lookAt(box);
}

function nameOf({ newest, cells }: FoldedChange): string {
  if (newest.label) return newest.label;
  return cells > 0 ? `${cells.toLocaleString()} cells` : newest.layer;
}

function ChangeRow({ change }: { change: FoldedChange }) {
  const { newest, times } = change;
  const { objectId, revision, time, author, layer } = newest;
  const verb = verbOf(newest);
  const when = time?.toLocaleTimeString() ?? `r${revision}`;
  const isThere = objectId !== undefined && live.value.find(objectId) !== undefined;
  return (
    <li class="change">
      <span class={`change-verb ${verb}`}>{verb}</span>
      <span class="grow">
        {isThere ? (
          <button class="link cut" onClick={() => look(objectId)}>
            {nameOf(change)}
          </button>
        ) : (
          <span class="cut">{nameOf(change)}</span>
        )}
        <small class="cut">
          {layer}
          {times > 1 && `, ${times} times`}
        </small>
      </span>
      <button
        class="link when number"
        aria-label={`${when}, revision ${revision}`}
        title={`Show the map at revision ${revision}, by ${author || 'the server'}`}
        onClick={() => showRevision(revision)}
      >
        {when}
      </button>
    </li>
  );
}

function Changes() {
  live.value.revision.value; // Rendered again after each commit, which may remove listed objects.
  const names = [...new Set(changes.value.map(({ layer }) => layer))].filter(Boolean).sort();
  const wanted = changes.value.filter(({ layer }) => !onlyLayer.value || layer === onlyLayer.value);
  if (changes.value.length === 0) {
    return <p class="note">Nothing has changed since this page was opened.</p>;
  }
  return (
    <div class="stack">
      <label class="field">
        Layer
        <select
          value={onlyLayer.value}
          onChange={(event) => (onlyLayer.value = event.currentTarget.value)}
        >
          <option value="">All layers</option>
          {names.map((name) => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      </label>
      <ol class="changes" aria-label="Changes">
        {foldChanges(wanted).map((change) => (
          <ChangeRow key={change.newest.key} change={change} />
        ))}
      </ol>
    </div>
  );
}

export const changesPanel: Panel = {
  id: 'changes',
  title: 'Changes',
  icon: ChangesIcon,
  component: Changes,
  place: 'right',
  shortcut: 'c',
};
