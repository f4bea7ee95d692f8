// Edits of the shown map, one at a time, with undo of all edits of this page.
import { Code, ConnectError, timestampDate } from '@hypermap/client';
import { effect, signal } from '@preact/signals';
import { client, messageOf } from './connection';
import { EditHistory, StaleEdit, type ObjectEdit, type WantedEdit } from './edit_history';
import { liveIncarnation, replacements } from './live';
import type { Object$ } from './model';
import { selectedId } from './selection';
import { mapFrame, mapName } from './site';

/** Whether an edit waits for the server's answer. */
export const editing = signal(false);
/** The error message of the last edit. Undefined if it succeeded. */
export const editProblem = signal<string>();
/** The titles of the edits that undo and redo would apply. Undefined if there is none. */
export const undoTitle = signal<string>();
export const redoTitle = signal<string>();

/** The tag of objects that an operator has confirmed. */
export const PINNED = 'pinned';

const history = new EditHistory(apply);

async function apply({ layer, id, version: ifVersion, object }: WantedEdit) {
  const map = mapName.value;
  const frameId = mapFrame.value;
  if (map === undefined || frameId === undefined) throw new Error('The map is not loaded yet.');
  const edit = object
    ? ({ case: 'putObject', value: putOf(layer, { ...object, id }, frameId, ifVersion) } as const)
    : ({ case: 'deleteObject', value: { layer, id, ifVersion } } as const);
  try {
    const incarnation = liveIncarnation.value;
    const answer = await client.value.edit.applyEdits({ map, incarnation, edits: [{ edit }] });
    return { id: answer.objectIds[0] ?? 0n, revision: answer.revision };
  } catch (error) {
    const { code } = ConnectError.from(error);
    if (code !== Code.Aborted && code !== Code.NotFound) throw error;
    const isAnotherMap = messageOf(error).includes('another incarnation');
    const what = isAnotherMap ? 'replaced the map' : 'changed the object';
    throw new StaleEdit(`Somebody else has ${what} in the meantime.`);
  }
}

function putOf(layer: string, object: Object$, frameId: string, ifVersion: bigint | undefined) {
  return { layer, object, frameId, ifVersion, timeToLive: timeToLive(object) };
}

/** The remaining lifetime of an object, at least a second, so that an edit does not extend it. */
function timeToLive({ expireTime }: Object$): { seconds: bigint } | undefined {
  if (!expireTime) return undefined;
  const leftMs = timestampDate(expireTime).getTime() - Date.now();
  return { seconds: BigInt(Math.max(1, Math.round(leftMs / 1000))) };
}

/** Runs an edit unless another one is pending. Returns whether it succeeded. */
async function once(run: () => Promise<unknown>): Promise<boolean> {
  if (editing.value) return false;
  editing.value = true;
  editProblem.value = undefined;
  try {
    await run();
    return true;
  } catch (error) {
    editProblem.value = error instanceof StaleEdit ? error.message : messageOf(error);
    return false;
  } finally {
    undoTitle.value = history.undoTitle;
    redoTitle.value = history.redoTitle;
    editing.value = false;
  }
}

/** Applies an edit and selects the object. */
export function editObject(edit: ObjectEdit): Promise<boolean> {
  return once(async () => {
    const id = await history.do(edit);
    selectedId.value = edit.after ? id : undefined;
  });
}

/** Confirms that the object exists as it is. Fusion does not change pinned objects. */
export function pinObject(layer: string, before: Object$): Promise<boolean> {
  const tags = [...before.tags.filter((tag) => tag !== PINNED), PINNED];
  const after = { ...before, tags, existence: 1 };
  return editObject({ title: `pin ${before.label}`, layer, before, after });
}

export function removeObject(layer: string, before: Object$): Promise<boolean> {
  return editObject({ title: `delete ${before.label}`, layer, before, after: undefined });
}

export async function undo(): Promise<void> {
  await once(async () => (selectedId.value = (await history.undo()) || undefined));
}

export async function redo(): Promise<void> {
  await once(async () => (selectedId.value = (await history.redo()) || undefined));
}

/** Clears the undo history whenever another map is shown, or has replaced the shown one. */
export function startEdits(): void {
  effect(() => {
    mapName.value;
    replacements.value;
    history.forget();
    undoTitle.value = undefined;
    redoTitle.value = undefined;
    editProblem.value = undefined;
  });
}
