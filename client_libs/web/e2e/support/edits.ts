import type { Place } from './dashboard.js';
import type { Site } from './site.js';

function square([x, y]: Place) {
  const points = [
    { x, y },
    { x: x + 0.5, y },
    { x: x + 0.5, y: y + 0.5 },
    { x, y: y + 0.5 },
  ];
  return { outer: { points } };
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
  const object = { id, label, existence, polygon: square([x, y]) };
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
  const edit = { case: 'fillPolygon' as const, value: { layer, area: square(corner), value } };
  await site.client().edit.applyEdits({ map: 'office', edits: [{ edit }] });
}
