import { useEffect } from 'preact/hooks';
import {
  chooseSource,
  chooseSourceLayer,
  chooseTargetLayer,
  estimate,
  estimateFromLayers,
  followAlignment,
  otherMaps,
  sourceChoice,
  sourceLayer,
  sourceLayers,
  sourceMap,
  targetChoice,
  targetLayer,
} from '../state/align';
import type { Layer } from '../state/model';
import { overlay } from '../state/overlay';
import { mapName } from '../state/site';
import { asOf, backToLive } from '../state/time';
import { AlignAnswer } from './align_answer';
import './align_panel.css';
import { AlignPairs } from './align_pairs';
import { AlignIcon } from './kit/icons';
import type { Panel } from './panel';

interface LayerFieldProps {
  title: string;
  of: readonly Layer[];
  value: Layer | undefined;
  onChange: (name: string) => void;
}

function LayerField({ title, of, value, onChange }: LayerFieldProps) {
  return (
    <label class="field">
      {title}
      <select value={value?.name} onChange={(event) => onChange(event.currentTarget.value)}>
        {of.map(({ name }) => (
          <option key={name}>{name}</option>
        ))}
      </select>
    </label>
  );
}

function Problem({ of }: { of: string | undefined }) {
  if (!of) return null;
  return (
    <p class="note bad" role="alert">
      {of}
    </p>
  );
}

function SourceField() {
  return (
    <label class="field">
      Map to lay over {mapName.value}
      <select
        value={sourceMap.value ?? ''}
        onChange={(event) => chooseSource(event.currentTarget.value || undefined)}
      >
        <option value="">Choose a map</option>
        {otherMaps.value.map((name) => (
          <option key={name}>{name}</option>
        ))}
      </select>
    </label>
  );
}

/** The layers to compare, and what is done with them. */
function Comparison({ source }: { source: string }) {
  if (sourceLayers.answer.value?.map !== source) {
    return sourceLayers.problem.value ? null : <p class="note">Loading …</p>;
  }
  if (!sourceLayer.value) {
    return (
      <p class="note">
        Nothing can be compared: the two maps need layers of occupancy, or layers of objects.
      </p>
    );
  }
  return (
    <>
      <div class="row fields">
        <LayerField
          title={`Layer of ${source}`}
          of={sourceChoice.value}
          value={sourceLayer.value}
          onChange={chooseSourceLayer}
        />
        <LayerField
          title={`Layer of ${mapName.value}`}
          of={targetChoice.value}
          value={targetLayer.value}
          onChange={chooseTargetLayer}
        />
      </div>
      <p class="row align-legend">
        <span class="align-swatch" />
        <small>{overlay.busy.value ? `Loading ${source} …` : `${source} over the shown map`}</small>
      </p>
      <Problem of={overlay.problem.value} />
      <div class="row actions">
        <button
          class="primary"
          disabled={estimate.busy.value}
          onClick={() => void estimateFromLayers()}
        >
          {estimate.busy.value ? 'Estimating …' : 'Estimate'}
        </button>
        {estimate.busy.value && <button onClick={() => estimate.forget()}>Cancel</button>}
      </div>
      <AlignPairs key={source} source={source} />
      <Problem of={estimate.problem.value} />
      <AlignAnswer />
    </>
  );
}

function Alignment() {
  useEffect(followAlignment, []);
  if (otherMaps.value.length === 0) {
    return <p class="note">There is no other map on this server.</p>;
  }
  return (
    <div class="stack">
      <SourceField />
      <Problem of={sourceLayers.problem.value} />
      {sourceMap.value !== undefined && <Comparison source={sourceMap.value} />}
    </div>
  );
}

function AlignPanel() {
  if (asOf.value === undefined) return <Alignment />;
  return (
    <div class="stack">
      <p class="note">
        You are viewing an earlier revision. Another map is laid over the newest one.
      </p>
      <button onClick={backToLive}>Back to live</button>
    </div>
  );
}

export const alignPanel: Panel = {
  id: 'align',
  title: 'Align',
  icon: AlignIcon,
  component: AlignPanel,
  place: 'right',
  shortcut: 'a',
};
