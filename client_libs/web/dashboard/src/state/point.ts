// Point queries: the content of every layer at the clicked point.
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
  /** The content of every layer of the map, sorted by name. */
  layers: readonly LayerContent[];
}

export const point = asking<PointAnswer>();

/** Queries all layers at a point and selects the object there, if any. */
export async function askPoint(at: Position): Promise<void> {
  highlight.value = { ...NO_HIGHLIGHT, point: at };
  const answer = await contentAt(at);
  if (answer) selectedId.value = objectMeant(answer)?.id;
}

/** Repeats the query at the same point. */
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

// Of several objects at the point the smallest one is selected, because the larger ones can be
// clicked elsewhere.
function objectMeant({ layers }: PointAnswer): Object$ | undefined {
  const shown = new Set(visibleLayers.value.map(({ name }) => name));
  return layers
    .filter(({ layer }) => shown.has(layer) && drawableLayers.value.includes(layer))
    .flatMap(({ objects }) => objects)
    .sort((a, b) => areaOf(a) - areaOf(b))
    .at(0);
}
