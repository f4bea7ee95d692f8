// Point queries: the content of every layer at the clicked point.
import type { LayerContent } from '@hypermap/client';
import { asking, shownRevision, shownScope } from './asking';
import { client } from './connection';
import type { Object$, Position } from './model';
import { drawableLayers } from './objects';
import { highlight, NO_HIGHLIGHT, selectedId } from './selection';
import { isHit, objectsAt } from './shapes';
import { mapName, visibleLayers } from './site';

export interface PointAnswer {
  at: Position;
  /** The distance within which lines and points count as being there, metres. */
  reachM: number;
  revision: bigint;
  /** The content of every layer of the map, sorted by name. */
  layers: readonly LayerContent[];
}

export const point = asking<PointAnswer>();

/**
 * Queries all layers at a point and selects the object there, if any. Lines and points that are at
 * most `reachM` metres away count as being there.
 */
export async function askPoint(at: Position, reachM: number): Promise<void> {
  highlight.value = { ...NO_HIGHLIGHT, point: at };
  const answer = await contentAt(at, reachM);
  if (answer) selectedId.value = objectMeant(answer)?.id;
}

/** Repeats the query at the same point. */
export async function refreshPoint(): Promise<void> {
  const answer = point.answer.peek();
  if (answer) await contentAt(answer.at, answer.reachM);
}

async function contentAt(at: Position, reachM: number): Promise<PointAnswer | undefined> {
  const map = mapName.peek();
  if (map === undefined) return undefined;
  return point.ask(async (signal) => {
    const request = {
      scope: shownScope(map),
      point: { x: at[0], y: at[1] },
      toleranceM: reachM,
      asOf: shownRevision(),
    };
    const { revision, layers } = await client.value.query.queryPoint(request, { signal });
    // The tolerance also finds polygons beside the point, which are not meant.
    const meant = layers.map((content) => ({
      ...content,
      objects: content.objects.filter((object) => isHit(object, at, reachM)),
    }));
    return { at, reachM, revision, layers: meant };
  });
}

function objectMeant({ layers, at, reachM }: PointAnswer): Object$ | undefined {
  const shown = new Set(visibleLayers.value.map(({ name }) => name));
  const objects = layers
    .filter(({ layer }) => shown.has(layer) && drawableLayers.value.includes(layer))
    .flatMap((content) => content.objects);
  return objectsAt(objects, at, reachM)[0];
}
