import { useSignal } from '@preact/signals';
import { cellsWords } from '../state/cells_words';
import {
  ask,
  find,
  type Answer,
  type Finding,
  type FoundCells,
  type Question,
} from '../state/find';
import { contentOf } from '../state/layer_content';
import { boxAround, ringArea } from '../state/measures';
import type { Object$ } from '../state/model';
import { lookAt, selectedId } from '../state/selection';
import { boxOf } from '../state/shapes';
import { layerNamed } from '../state/site';
import { asOf, shown } from '../state/time';
import { count, metres, percent, shapeWords, squareMetres, statusWords } from '../state/words';
import { openPanel } from './active';
import { CloseIcon } from './kit/icons';
import { Swatch } from './kit/swatch';

const LISTED_AT_ONCE = 100;

function titleOf(question: Question): string {
  if (question.kind === 'area') return `Area of ${squareMetres(ringArea(question.ring))}`;
  if (question.kind === 'nearest') return `Nearest “${question.value}”`;
  return question.ring
    ? `“${question.value}” in ${squareMetres(ringArea(question.ring))}`
    : `“${question.value}”`;
}

function select(object: Object$): void {
  const box = boxOf(object);
  selectedId.value = object.id;
  if (box) lookAt(box);
}

interface CellsProps {
  layer: string;
  cells: FoundCells;
  distanceM: number | undefined;
}

function ObjectRow({ object, distanceM }: { object: Object$; distanceM: number | undefined }) {
  const { id, label, existence } = object;
  const isSelected = selectedId.value === id;
  return (
    <li class="row found">
      <button class="grow" aria-current={isSelected} onClick={() => select(object)}>
        <Swatch object={object} />
        <span class="grow cut">
          {label} <small>{shapeWords(object)}</small>
        </span>
        <small class="number">
          {distanceM === undefined ? percent(existence ?? 1) : metres(distanceM)}
        </small>
      </button>
      {isSelected && (
        <button class="details" onClick={() => openPanel('here')}>
          Details
        </button>
      )}
    </li>
  );
}

/** Summarizes the values of cells. Undefined if the question was about one value of them anyway. */
function wordsOf(name: string, { runs }: FoundCells): string | undefined {
  const layer = layerNamed(name);
  const isArea = find.answer.value?.question.kind === 'area';
  if (!layer || !(isArea || contentOf(layer) === 'measurements')) return undefined;
  return cellsWords(layer, runs);
}

function CellsRow({ layer, cells, distanceM }: CellsProps) {
  const { count: cellCount, areaM2, box } = cells;
  return (
    <li class="row found">
      <button class="grow" onClick={() => box && lookAt(box)}>
        <span class="swatch cells" />
        <span class="grow">
          {count(cellCount, 'cell', 'cells')}
          <small class="cell-words">{wordsOf(layer, cells)}</small>
        </span>
        <small class="number">
          {distanceM === undefined ? squareMetres(areaM2) : metres(distanceM)}
        </small>
      </button>
    </li>
  );
}

function Row({ finding: { layer, object, cells, distanceM } }: { finding: Finding }) {
  if (object) return <ObjectRow object={object} distanceM={distanceM} />;
  return cells ? <CellsRow layer={layer} cells={cells} distanceM={distanceM} /> : null;
}

/** The results of one layer, or of all layers by distance. */
interface Group {
  title: string;
  findings: Finding[];
}

function groupsOf({ question, findings }: Answer, most: number): Group[] {
  const listed = findings.slice(0, most);
  if (question.kind === 'nearest') {
    return listed.length > 0 ? [{ title: 'By distance', findings: listed }] : [];
  }
  const groups = new Map<string, Finding[]>();
  for (const finding of listed) {
    const group = groups.get(finding.layer) ?? [];
    groups.set(finding.layer, [...group, finding]);
  }
  return Array.from(groups, ([title, found]) => ({ title, findings: found }));
}

/** Lists the layers that can't answer. This is normal, because most values exist on few layers. */
function Refusals({ refusals }: Answer) {
  if (refusals.length === 0) return null;
  return (
    <details>
      <summary>{count(refusals.length, 'layer', 'layers')} without an answer</summary>
      <dl class="facts">
        {refusals.map(({ layer, status }) => (
          <>
            <dt>{layer}</dt>
            <dd class="soft">{statusWords(status)}</dd>
          </>
        ))}
      </dl>
    </details>
  );
}

function summaryOf({ findings }: Answer): string {
  const objects = findings.filter(({ object }) => object).length;
  const grids = findings.length - objects;
  if (findings.length === 0) return 'nothing found';
  const parts = [objects > 0 && count(objects, 'object', 'objects'), grids > 0 && 'cells'];
  return `${parts.filter(Boolean).join(' and ')} found`;
}

function lookAtAll({ findings }: Answer): void {
  const boxes = findings.flatMap(({ object, cells }) => {
    const box = object ? boxOf(object) : cells?.box;
    return box ? [box] : [];
  });
  const all = boxAround(
    boxes.flatMap(([x0, y0, x1, y1]): [number, number][] => [
      [x0, y0],
      [x1, y1],
    ]),
  );
  if (all) lookAt(all);
}

/** The results of a question, grouped by layer. */
export function AnswerList({ answer, onClear }: { answer: Answer; onClear: () => void }) {
  const most = useSignal(LISTED_AT_ONCE);
  const { question, findings, revision } = answer;
  const left = findings.length - most.value;
  const isOld = shown.value.revision.value !== revision;
  return (
    <section class="stack answer" aria-label="Answer">
      <header class="row">
        <h3 class="grow">
          {titleOf(question)}: <span role="status">{summaryOf(answer)}</span>
          {asOf.value !== undefined && ` as of revision ${revision}`}
        </h3>
        <button class="bare" aria-label="Clear the answer" title="Clear" onClick={onClear}>
          <CloseIcon />
        </button>
      </header>
      {isOld && (
        <p class="note row">
          <span class="grow">The map has changed since.</span>
          <button onClick={() => void ask(question)}>Ask again</button>
        </p>
      )}
      {groupsOf(answer, most.value).map(({ title, findings: found }) => (
        <section key={title} aria-label={title}>
          <h3>{title}</h3>
          <ul class="choices findings">
            {found.map((finding, i) => (
              <Row key={finding.object ? `${finding.object.id}` : i} finding={finding} />
            ))}
          </ul>
        </section>
      ))}
      {left > 0 && (
        <button onClick={() => (most.value += LISTED_AT_ONCE)}>
          {count(left, 'more', 'more')}
        </button>
      )}
      {findings.length > 1 && (
        <button onClick={() => lookAtAll(answer)}>Show all on the map</button>
      )}
      <Refusals {...answer} />
    </section>
  );
}
