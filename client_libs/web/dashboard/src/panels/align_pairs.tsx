import { signal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { cancelTool, drawShape } from '../map/tools';
import {
  estimate,
  estimateFromPairs,
  LEAST_PAIRS,
  placement,
  resultOf,
  type PairResult,
} from '../state/align';
import type { Position } from '../state/model';
import {
  beginPair,
  dropBegunPair,
  endPair,
  pairs,
  removePair,
  type PlacePair,
} from '../state/place_pairs';
import { mapName } from '../state/site';
import { metres } from '../state/words';
import { CloseIcon } from './kit/icons';

/** Whether the user is clicking pairs. */
const picking = signal(false);

/** Lets the user click a place. Undefined if they cancel. */
async function pick(hint: string): Promise<Position | undefined> {
  const { shape } = (await drawShape('point', hint)) ?? {};
  return shape?.case === 'point' ? [shape.value.x, shape.value.y] : undefined;
}

/** Lets the user click pairs until they cancel, or `stopPicking` is called. */
async function pickPairs(source: string): Promise<void> {
  picking.value = true;
  while (picking.peek()) {
    const name = `Pair ${pairs.peek().length + 1}`;
    const onOverlay = await pick(`${name}: click a place of ${source}, as it lies now`);
    if (!onOverlay) break;
    beginPair(onOverlay, placement.peek());
    const target = await pick(`${name}: click where it belongs in ${mapName.peek()}`);
    if (!target) break;
    endPair(target);
  }
  dropBegunPair();
  picking.value = false;
}

function stopPicking(): void {
  if (!picking.peek()) return;
  picking.value = false;
  cancelTool();
}

function resultWords({ agrees, residualM }: PairResult): string {
  return agrees ? metres(residualM) : `${metres(residualM)}, does not agree`;
}

function PairRow({ pair, name }: { pair: PlacePair; name: string }) {
  const answer = estimate.answer.value;
  const result = answer && resultOf(answer, pair);
  const [x, y] = pair.target;
  return (
    <li class="row">
      <span class="grow number">
        {name}: {x.toFixed(2)}, {y.toFixed(2)}
      </span>
      {result && <small class="number">{resultWords(result)}</small>}
      <button class="bare" aria-label={`Remove pair ${name}`} onClick={() => removePair(pair)}>
        <CloseIcon />
      </button>
    </li>
  );
}

/** The pairs of places, from which the transform can be estimated instead of from the layers. */
export function AlignPairs({ source }: { source: string }) {
  useEffect(() => stopPicking, []);
  return (
    <section class="stack" aria-label="Point pairs">
      <h3>Point pairs</h3>
      {pairs.value.length === 0 && (
        <p class="note">
          Or click places that you know in both maps: first where {source} lies now, then where it
          belongs.
        </p>
      )}
      {pairs.value.length > 0 && (
        <ol class="align-pairs" aria-label="Pairs">
          {pairs.value.map((pair, i) => (
            <PairRow key={i} pair={pair} name={`${i + 1}`} />
          ))}
        </ol>
      )}
      <div class="row actions">
        {picking.value ? (
          <button onClick={stopPicking}>Done</button>
        ) : (
          <button onClick={() => void pickPairs(source)}>Add pairs</button>
        )}
        <button
          disabled={estimate.busy.value || pairs.value.length < LEAST_PAIRS}
          title={`From ${LEAST_PAIRS} pairs on`}
          onClick={() => void estimateFromPairs()}
        >
          Estimate from pairs
        </button>
      </div>
    </section>
  );
}
