import { polygonFromGeoJson, type Polygon } from '@hypermap/client';

import type { Place } from './dashboard.js';
import type { Site } from './site.js';

/** A polygon without holes. */
export function polygon(corners: readonly Place[]): Polygon {
  return polygonFromGeoJson({ type: 'Polygon', coordinates: [corners.map(([x, y]) => [x, y])] });
}

/** The shape of an object that is a polygon without holes. */
export function polygonShape(corners: readonly Place[]) {
  return { shape: { case: 'polygon' as const, value: polygon(corners) } };
}

function square([x, y]: Place): Place[] {
  return [
    [x, y],
    [x + 0.5, y],
    [x + 0.5, y + 0.5],
    [x, y + 0.5],
  ];
}

/**
 * Puts a square object of half a metre at its lower left corner, as another client. Returns its id.
 */
export async function putSquare(
  site: Site,
  layer: string,
  label: string,
  [x, y]: Place,
  id = 0n,
  existence = 1,
): Promise<bigint> {
  const object = { id, label, existence, shape: polygonShape(square([x, y])) };
  const edit = { case: 'putObject' as const, value: { layer, object } };
  const answer = await site.client().edit.applyEdits({ map: 'office', edits: [{ edit }] });
  return answer.objectIds[0] ?? 0n;
}

export async function deleteObject(site: Site, layer: string, id: bigint): Promise<void> {
  const edit = { case: 'deleteObject' as const, value: { layer, id } };
  await site.client().edit.applyEdits({ map: 'office', edits: [{ edit }] });
}

/** Writes the cells of a square of half a metre at its lower left corner, as another client. */
export async function fillSquare(
  site: Site,
  layer: string,
  corner: Place,
  value: number,
): Promise<void> {
  const edit = {
    case: 'fillPolygon' as const,
    value: { layer, area: polygon(square(corner)), value },
  };
  await site.client().edit.applyEdits({ map: 'office', edits: [{ edit }] });
}
