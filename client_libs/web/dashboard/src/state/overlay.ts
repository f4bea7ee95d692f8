// The walls or objects of a layer of another map, which are drawn over the shown map.
import { asking } from './asking';
import { client } from './connection';
import { AnswerStatus, LayerKind, type CellRuns, type Layer, type Object$ } from './model';
import { atRevision, EVERYWHERE } from './time';
import { statusWords } from './words';

/** The content of the layer in the own frame of its map. */
export interface Overlay {
  map: string;
  layer: string;
  revision: bigint;
  /** The occupied cells of a layer of occupancy. */
  cells: readonly CellRuns[];
  objects: readonly Object$[];
}

/** The revision of a map to read. */
export interface ReadAt {
  revision: bigint;
  incarnation: bigint;
}

export const overlay = asking<Overlay>();

/** Loads the overlay. Without `at`, its newest revision. */
export async function loadOverlay(
  map: string,
  layer: Pick<Layer, 'name' | 'kind'>,
  at?: ReadAt,
): Promise<void> {
  await overlay.ask(async (signal) => {
    const scope = { map, layers: [layer.name], incarnation: at?.incarnation ?? 0n };
    const request = { scope, ...(at && { asOf: atRevision(at.revision) }) };
    const { query } = client.value;
    const parts =
      layer.kind === LayerKind.OCCUPANCY
        ? query.queryValue({ ...request, value: 'occupied' }, { signal })
        : query.queryArea({ ...request, area: EVERYWHERE }, { signal });
    const cells: CellRuns[] = [];
    const objects: Object$[] = [];
    let revision = 0n;
    for await (const told of parts) {
      revision = told.revision;
      if (!told.part) continue;
      const { status } = told.part;
      if (status !== AnswerStatus.VALUE) throw new Error(`${layer.name}: ${statusWords(status)}`);
      if (told.part.cells?.rows.length) cells.push(told.part.cells);
      objects.push(...told.part.objects);
    }
    return { map, layer: layer.name, revision, cells, objects };
  });
}
