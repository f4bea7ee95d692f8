import type { LayerContent } from '@hypermap/client';
import { useEffect } from 'preact/hooks';
import { followEvidence } from '../state/evidence';
import { AnswerStatus, type Object$ } from '../state/model';
import { point } from '../state/point';
import { selected, selectedId } from '../state/selection';
import { layerNamed } from '../state/site';
import { asOf } from '../state/time';
import { cellWords, percent, shapeWords, statusWords } from '../state/words';
import './here_panel.css';
import { InfoIcon } from './kit/icons';
import { Swatch } from './kit/swatch';
import { ObjectCard } from './object_card';
import type { Panel } from './panel';

function ObjectChip({ object }: { object: Object$ }) {
  const { id, label, existence } = object;
  return (
    <button
      class="chip"
      aria-pressed={selectedId.value === id}
      title={`Object ${id}: ${shapeWords(object)}`}
      onClick={() => (selectedId.value = id)}
    >
      <Swatch object={object} />
      <span class="cut">{label}</span>
      <small class="number">{percent(existence ?? 1)}</small>
    </button>
  );
}

function Content({ content }: { content: LayerContent }) {
  const { status, value, objects } = content;
  if (status !== AnswerStatus.VALUE) return <span class="soft">{statusWords(status)}</span>;
  if (value !== undefined) {
    const layer = layerNamed(content.layer);
    return <span>{layer ? cellWords(layer, value) : value}</span>;
  }
  if (objects.length === 0) return <span class="soft">nothing</span>;
  return (
    <span class="chips">
      {objects.map((object) => (
        <ObjectChip key={`${object.id}`} object={object} />
      ))}
    </span>
  );
}

function AtPoint() {
  const answer = point.answer.value;
  if (point.problem.value) {
    return (
      <p class="note bad" role="alert">
        {point.problem.value}
      </p>
    );
  }
  if (!answer) return null;
  const [x, y] = answer.at.map((coordinate) => coordinate.toFixed(2));
  return (
    <section aria-label="At this point" aria-busy={point.busy.value}>
      <h3>
        At {x}, {y}
        {asOf.value !== undefined && ` as of revision ${answer.revision}`}
      </h3>
      <dl class="contents">
        {answer.layers.map((content) => (
          <div key={content.layer}>
            <dt class="cut">{content.layer}</dt>
            <dd>
              <Content content={content} />
            </dd>
          </div>
        ))}
      </dl>
    </section>
  );
}

function Here() {
  useEffect(followEvidence, []);
  const nothing = !point.answer.value && !point.problem.value && selectedId.value === undefined;
  return (
    <div class="stack">
      {selected.value && <ObjectCard {...selected.value} />}
      {selectedId.value !== undefined && !selected.value && (
        <p class="note">
          {asOf.value !== undefined
            ? 'This object is not on the map at this revision.'
            : 'This object is no longer on the map.'}
        </p>
      )}
      <AtPoint />
      {nothing && (
        <p class="note">
          Click the map to query all layers at a point. Enter queries the centre of the map.
        </p>
      )}
    </div>
  );
}

export const herePanel: Panel = {
  id: 'here',
  title: 'Here',
  icon: InfoIcon,
  component: Here,
  place: 'right',
  shortcut: 'h',
};
