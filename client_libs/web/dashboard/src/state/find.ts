// Searches by value, area and distance. Answers are listed in a panel and marked on the map.
import type {
  CellRuns,
  LayerPart,
  MessageInitShape,
  QueryAreaRequestSchema,
} from '@hypermap/client';
import { asking, shownRevision, shownScope } from './asking';
import { client } from './connection';
import { measureCells, type CellsMeasure } from './measures';
import { AnswerStatus, type Object$, type Position } from './model';
import { polygonOf } from './objects';
import { highlight, NO_HIGHLIGHT, type Highlight } from './selection';
import { mapName } from './site';

export type Question =
  | { kind: 'area'; ring: Position[] }
  | { kind: 'value'; value: string; ring?: Position[] | undefined }
  | { kind: 'nearest'; value: string; from: Position };

/** The cells of one grid that a search found. */
export interface FoundCells extends CellsMeasure {
  runs: readonly CellRuns[];
}

/** One search result: an object or the cells of one grid. */
export interface Finding {
  layer: string;
  object?: Object$ | undefined;
  cells?: FoundCells | undefined;
  /** Set only in answers to a search for the nearest. */
  distanceM?: number | undefined;
}

/** A layer that can't answer the question, and the reason. */
export interface Refusal {
  layer: string;
  status: AnswerStatus;
}

export interface Answer {
  question: Question;
  revision: bigint;
  /**
   * Objects by layer, then the cells of each grid; in a search for the nearest ordered by distance.
   */
  findings: readonly Finding[];
  refusals: readonly Refusal[];
}

/** The number of results of a search for the nearest. */
const NEAREST = 10;

export const find = asking<Answer>();

/** Asks a question and marks the results on the map. */
export async function ask(question: Question): Promise<void> {
  highlight.value = { ...NO_HIGHLIGHT, ...placeOf(question) };
  await findAndMark(question);
}

/** Asks the last question again. */
export async function refreshAnswer(): Promise<void> {
  const question = find.answer.peek()?.question;
  if (question) await findAndMark(question);
}

async function findAndMark(question: Question): Promise<void> {
  const map = mapName.peek();
  if (map === undefined) return;
  const answer = await find.ask((signal) => answerOf(map, question, signal));
  if (answer) highlight.value = highlightOf(answer);
}

export function forgetAnswer(): void {
  find.forget();
  highlight.value = NO_HIGHLIGHT;
}

function answerOf(map: string, question: Question, signal: AbortSignal): Promise<Answer> {
  if (question.kind === 'nearest') return nearest(map, question, signal);
  const { query } = client.value;
  const area = question.ring && { area: polygonOf([question.ring]) };
  const request = { scope: shownScope(map), asOf: shownRevision(), ...area };
  return collect(
    question,
    question.kind === 'area'
      ? query.queryArea(request satisfies MessageInitShape<typeof QueryAreaRequestSchema>, {
          signal,
        })
      : query.queryValue({ ...request, value: question.value }, { signal }),
  );
}

interface Part {
  revision: bigint;
  part?: LayerPart | undefined;
}

async function collect(question: Question, parts: AsyncIterable<Part>): Promise<Answer> {
  const findings: Finding[] = [];
  const runsOfLayer = new Map<string, CellRuns[]>();
  const refusals: Refusal[] = [];
  let revision = 0n;
  for await (const told of parts) {
    revision = told.revision;
    if (!told.part) continue;
    const { layer, status, objects, cells } = told.part;
    if (status !== AnswerStatus.VALUE) refusals.push({ layer, status });
    for (const object of objects) findings.push({ layer, object });
    if (!cells?.rows.length) continue;
    const runs = runsOfLayer.get(layer) ?? [];
    runsOfLayer.set(layer, [...runs, cells]);
  }
  for (const [layer, runs] of runsOfLayer) findings.push({ layer, cells: foundCells(runs) });
  return { question, revision, findings, refusals };
}

function foundCells(runs: readonly CellRuns[]): FoundCells {
  return { runs, ...measureCells(runs) };
}

async function nearest(
  map: string,
  question: Extract<Question, { kind: 'nearest' }>,
  signal: AbortSignal,
): Promise<Answer> {
  const [x, y] = question.from;
  const request = {
    scope: shownScope(map),
    point: { x, y },
    value: question.value,
    k: NEAREST,
    asOf: shownRevision(),
  };
  const answer = await client.value.query.queryNearest(request, { signal });
  const findings = answer.matches.map(({ layer, object, cells, distanceM }) => ({
    layer,
    object,
    cells: cells && foundCells([cells]),
    distanceM,
  }));
  return { question, revision: answer.revision, findings, refusals: answer.refusals };
}

function placeOf(question: Question): Partial<Highlight> {
  if (question.kind === 'nearest') return { point: question.from };
  return { area: question.ring };
}

function highlightOf({ question, findings }: Answer): Highlight {
  return {
    objectIds: findings.flatMap(({ object }) => (object ? [object.id] : [])),
    // The cells of an area cover all of it: its outline is enough.
    cells: question.kind === 'area' ? [] : findings.flatMap(({ cells }) => cells?.runs ?? []),
    ...placeOf(question),
  };
}
