// The shown revision: the newest one or an earlier one.
import { Code, ConnectError, timestampDate, timestampFromDate } from '@hypermap/client';
import { batch, computed, effect, signal, untracked } from '@preact/signals';
import { client, messageOf } from './connection';
import { live, liveIncarnation, liveRevision, replacements } from './live';
import { MapContent } from './map_content';
import { mapName } from './site';

/** The earlier revision that is shown. Undefined to follow the newest. */
export const asOf = signal<bigint>();
/** The content of that revision; while it loads, the content of the previous one. */
const past = signal<MapContent>();
/** Whether the content of an earlier revision is loading. */
export const asOfLoading = signal(false);
/** The reason why the earlier revision can't be shown. */
export const asOfProblem = signal<string>();

/** The content that is drawn and listed. */
export const shown = computed(() =>
  asOf.value === undefined ? live.value : (past.value ?? live.value),
);

export interface Commit {
  revision: bigint;
  time: Date | undefined;
  author: string;
  numChanges: bigint;
}

/** The oldest revision that the server keeps. */
export const oldest = signal(0n);
/** The commit of the earlier revision that is shown. */
export const asOfCommit = signal<Commit>();

/** Loads the oldest kept revision, which changes because the server compacts its history. */
export async function loadOldest(): Promise<void> {
  const map = mapName.value;
  if (map === undefined) return;
  try {
    const answer = await client.value.changes.listRevisions({ map, pageSize: 1 });
    if (map === mapName.value) oldest.value = answer.oldestRevision;
  } catch {
    // Without this value the slider reaches too far back; showing such a revision reports its own
    // error.
  }
}

async function commitOf(map: string, revision: bigint, signal: AbortSignal): Promise<Commit> {
  // Revision 0 is the empty map, which has no commit.
  const afterRevision = revision > 0n ? revision - 1n : 0n;
  const incarnation = liveIncarnation.peek();
  const request = { map, incarnation, afterRevision, pageSize: 1 };
  const { revisions } = await client.value.changes.listRevisions(request, { signal });
  const info = revisions.find((found) => found.revision === revision);
  const time = info?.time && timestampDate(info.time);
  return { revision, time, author: info?.author ?? '', numChanges: info?.numChanges ?? 0n };
}

// Half the side of a box that is larger than any site, metres.
const FAR = 1e6;
/** An area around any site. */
export const EVERYWHERE = { outer: { xs: [-FAR, FAR, FAR, -FAR], ys: [-FAR, -FAR, FAR, FAR] } };

/** A revision as the field `asOf` of a question. */
export function atRevision(value: bigint) {
  return { asOf: { case: 'atRevision', value } } as const;
}

/** Shows the map as of a time. */
export async function showTime(time: Date): Promise<void> {
  const map = mapName.value;
  if (map === undefined) return;
  // The answer to any query names the revision at that time. The first part is enough.
  const atTime = { asOf: { case: 'atTime', value: timestampFromDate(time) } } as const;
  try {
    const scope = { map, incarnation: liveIncarnation.peek() };
    const request = { scope, area: EVERYWHERE, asOf: atTime };
    for await (const { revision } of client.value.query.queryArea(request)) {
      showRevision(revision);
      return;
    }
  } catch (error) {
    asOfProblem.value = messageOf(error);
  }
}

/** Shows a revision. The newest one is shown live. */
export function showRevision(revision: bigint): void {
  asOfProblem.value = undefined;
  asOf.value = revision < liveRevision.value ? revision : undefined;
}

export function backToLive(): void {
  asOf.value = undefined;
}

async function loadPast(map: string, revision: bigint, ended: AbortSignal): Promise<void> {
  const content = new MapContent();
  const scope = { map, incarnation: liveIncarnation.peek() };
  const request = { scope, area: EVERYWHERE, asOf: atRevision(revision) };
  const commit = commitOf(map, revision, ended);
  // The rejection is handled where the promise is awaited below.
  commit.catch(() => undefined);
  for await (const { part } of client.value.query.queryArea(request, { signal: ended })) {
    if (part) content.add(part);
  }
  content.step(revision);
  const shownCommit = await commit;
  batch(() => {
    past.value = content;
    asOfCommit.value = shownCommit;
  });
}

// Loads one revision at a time. Revisions that the user has already left are skipped.
async function followPast(map: string, ended: AbortSignal): Promise<void> {
  asOfLoading.value = true;
  try {
    for (let loaded: bigint | undefined; asOf.value !== loaded;) {
      loaded = asOf.value;
      if (loaded !== undefined) await loadPast(map, loaded, ended);
    }
  } catch (error) {
    if (ended.aborted) return;
    const { code } = ConnectError.from(error);
    // The live content must not be mistaken for the earlier revision.
    past.value = new MapContent();
    const why = code === Code.OutOfRange ? 'it is no longer kept' : messageOf(error);
    asOfProblem.value = `Revision ${asOf.value} can't be shown: ${why}.`;
  } finally {
    if (!ended.aborted) asOfLoading.value = false;
  }
}

function forget(): void {
  past.value = undefined;
  asOfCommit.value = undefined;
  asOfProblem.value = undefined;
  asOfLoading.value = false;
}

/** Starts to load the chosen revision whenever it changes. */
export function startTime(): void {
  let ended = new AbortController();
  effect(() => {
    mapName.value;
    replacements.value;
    untracked(() => {
      ended.abort();
      ended = new AbortController();
      oldest.value = 0n;
      forget();
      void loadOldest();
    });
  });
  effect(() => {
    const map = mapName.value;
    const revision = asOf.value;
    untracked(() => {
      if (map === undefined || revision === undefined) forget();
      else if (!asOfLoading.value) void followPast(map, ended.signal);
    });
  });
}
