// What is at a point: the content of every layer there.
import type { LayerContent } from '@hypermap/client';
import { asking, shownRevision } from './asking';
import { client } from './connection';
import type { Object$, Position } from './model';
import { areaOf } from './measures';
import { drawableLayers } from './objects';
import { highlight, NO_HIGHLIGHT, selectedId } from './selection';
import { mapName, visibleLayers } from './site';

export interface PointAnswer {
  at: Position;
  revision: bigint;
  /** Every layer of the map, by name. */
  layers: readonly LayerContent[];
}

export const point = asking<PointAnswer>();

/** Asks every layer what it has at a point, and selects the object that lies there, if any. */
export async function askPoint(at: Position): Promise<void> {
  highlight.value = { ...NO_HIGHLIGHT, point: at };
  const answer = await contentAt(at);
  if (answer) selectedId.value = objectMeant(answer)?.id;
}

/** Asks again about the same point. */
export async function refreshPoint(): Promise<void> {
  const at = point.answer.peek()?.at;
  if (at) await contentAt(at);
}

async function contentAt(at: Position): Promise<PointAnswer | undefined> {
  const map = mapName.peek();
  if (map === undefined) return undefined;
  return point.ask(async (signal) => {
    const request = { map, point: { x: at[0], y: at[1] }, asOf: shownRevision() };
    const { revision, layers } = await client.value.query.queryPoint(request, { signal });
    return { at, revision, layers };
  });
}

// Of things on each other the smallest: there are other places where to click for the larger.
function objectMeant({ layers }: PointAnswer): Object$ | undefined {
  const shown = new Set(visibleLayers.value.map(({ name }) => name));
  return layers
    .filter(({ layer }) => shown.has(layer) && drawableLayers.value.includes(layer))
    .flatMap(({ objects }) => objects)
    .sort((a, b) => areaOf(a) - areaOf(b))
    .at(0);
}
