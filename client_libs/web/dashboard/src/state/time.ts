// Now, or as of an earlier revision: what is shown.
import { Code, ConnectError, timestampDate, timestampFromDate } from '@hypermap/client';
import { batch, computed, effect, signal, untracked } from '@preact/signals';
import { client, messageOf } from './connection';
import { live, liveRevision } from './live';
import { MapContent } from './map_content';
import { mapName } from './site';

/** The revision that is looked at. Undefined: always the newest. */
export const asOf = signal<bigint>();
/** Its content; the one before it stays until it is there. */
const past = signal<MapContent>();
/** Whether content of the past is on its way. */
export const asOfLoading = signal(false);
/** Why the past can't be shown. */
export const asOfProblem = signal<string>();

/** The content to be drawn and listed. */
export const shown = computed(() =>
  asOf.value === undefined ? live.value : (past.value ?? live.value),
);

export interface Commit {
  revision: bigint;
  time: Date | undefined;
  author: string;
  numChanges: bigint;
}

/** The oldest revision that can be looked at. */
export const oldest = signal(0n);
/** Of the revision that is looked at. */
export const asOfCommit = signal<Commit>();

/** Asks which revisions are kept: with time, old ones are let go. */
export async function loadOldest(): Promise<void> {
  const map = mapName.value;
  if (map === undefined) return;
  try {
    const answer = await client.value.changes.listRevisions({ map, pageSize: 1 });
    if (map === mapName.value) oldest.value = answer.oldestRevision;
  } catch {
    // Whoever looks at a revision that is not kept is told then.
  }
}

async function commitOf(map: string, revision: bigint, signal: AbortSignal): Promise<Commit> {
  // Revision 0 is how the map was made: no commit.
  const afterRevision = revision > 0n ? revision - 1n : 0n;
  const request = { map, afterRevision, pageSize: 1 };
  const { revisions } = await client.value.changes.listRevisions(request, { signal });
  const info = revisions.find((found) => found.revision === revision);
  const time = info?.time && timestampDate(info.time);
  return { revision, time, author: info?.author ?? '', numChanges: info?.numChanges ?? 0n };
}

// Wider than any site, metres.
const FAR = 1e6;
const EVERYWHERE = {
  outer: {
    points: [
      { x: -FAR, y: -FAR },
      { x: FAR, y: -FAR },
      { x: FAR, y: FAR },
      { x: -FAR, y: FAR },
    ],
  },
};

/** Looks at the map as it was at a time. */
export async function showTime(time: Date): Promise<void> {
  const map = mapName.value;
  if (map === undefined) return;
  // Any question tells which revision was the newest then; of no layer, it is the cheapest.
  const asked = { case: 'atTime', value: timestampFromDate(time) } as const;
  try {
    const request = { map, area: EVERYWHERE, asOf: asked };
    for await (const { revision } of client.value.query.queryArea(request)) {
      showRevision(revision);
      return;
    }
  } catch (error) {
    asOfProblem.value = messageOf(error);
  }
}

/** Looks at a revision; at the newest one that is live. */
export function showRevision(revision: bigint): void {
  asOfProblem.value = undefined;
  asOf.value = revision < liveRevision.value ? revision : undefined;
}

export function backToLive(): void {
  asOf.value = undefined;
}

async function loadPast(map: string, revision: bigint, ended: AbortSignal): Promise<void> {
  const content = new MapContent();
  const asked = { case: 'atRevision', value: revision } as const;
  const request = { map, area: EVERYWHERE, asOf: asked };
  const commit = commitOf(map, revision, ended);
  // Its failure is told where it is awaited.
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

// One revision after the other; those that were passed over meanwhile are left out.
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
    // What is live must not be taken for the past.
    past.value = new MapContent();
    const why = code === Code.OutOfRange ? 'it is not kept any more' : messageOf(error);
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

/** Begins to follow the wanted revision. */
export function startTime(): void {
  let ended = new AbortController();
  effect(() => {
    mapName.value;
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
