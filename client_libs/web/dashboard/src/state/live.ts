// The live content of the shown map. One watch serves the whole page, because browsers allow few
// connections to a server; robots.ts has another one for the robots.
import { Code, ConnectError, isTransient, watch, type WatchEvent } from '@hypermap/client';
import { batch, computed, effect, signal, untracked } from '@preact/signals';
import { forgetChanges, noteChanges } from './changes';
import { client, noteFailure, problem, signInWanted, status, tryAgain } from './connection';
import { MapContent } from './map_content';
import { ChangeKind } from './model';
import { loadLayers, loadMaps, mapName, maps } from './site';

/** The newest content. Replaced when another map is shown and after a new snapshot. */
export const live = signal(new MapContent());
/** Whether the first snapshot of the map has not arrived yet. */
export const loading = signal(true);
/** The incarnation of the shown map. 0 until its first snapshot has arrived. */
export const liveIncarnation = signal(0n);
/**
 * Counts the times that another incarnation has replaced the shown map. Revisions, versions and
 * object ids from before mean nothing in it.
 */
export const replacements = signal(0);

/** The incarnation of which the page address speaks; 0 if it names none. */
let expected = 0n;

/**
 * Says of which incarnation the first shown map is expected to be. If it is another one, the page
 * behaves as if the map had been replaced while it was shown. To be called before start().
 */
export function expectIncarnation(incarnation: bigint): void {
  expected = incarnation;
}

const LAYER_CHANGES = [
  ChangeKind.LAYER_CREATED,
  ChangeKind.LAYER_DELETED,
  ChangeKind.LAYER_CHANGED,
];

/** Builds the content of a map from the events of its watch. */
class Follower {
  // A new snapshot is collected here while the page still shows the previous content.
  #content = live.value;
  #inSnapshot = false;

  constructor(private readonly map: string) {}

  /** Drops a partial snapshot: the new connection sends it again from the beginning. */
  connecting(): void {
    this.#inSnapshot = false;
  }

  connected(): void {
    this.#loadLayers();
  }

  take(event: WatchEvent): void {
    if (event.snapshot && !this.#inSnapshot) this.#content = new MapContent();
    this.#inSnapshot = event.snapshot && !event.complete;
    if (event.snapshot) this.#takeSnapshot(event);
    else this.#takeCommit(event);
    const first = event.snapshot && event.complete;
    if (first || event.changes.some(({ kind }) => LAYER_CHANGES.includes(kind))) {
      this.#loadLayers();
    }
  }

  // Transient errors are ignored, because the layers are loaded again on the next connection.
  #loadLayers(): void {
    loadLayers(this.map).catch((error: unknown) => {
      if (!isTransient(error)) noteFailure(error);
    });
  }

  #takeSnapshot(event: WatchEvent): void {
    for (const change of event.changes) this.#content.apply(change);
    if (!event.complete) return;
    batch(() => {
      this.#content.step(event.revision);
      live.value = this.#content;
      loading.value = false;
      noteIncarnation(event.incarnation);
    });
  }

  #takeCommit(event: WatchEvent): void {
    const labels = new Map<bigint, string>();
    for (const { objectId } of event.changes) {
      const label = this.#content.find(objectId)?.object.label;
      if (label) labels.set(objectId, label);
    }
    batch(() => {
      for (const change of event.changes) this.#content.apply(change);
      this.#content.step(event.revision);
      noteChanges(event, event.changes, (id) => labels.get(id));
    });
  }
}

function noteIncarnation(incarnation: bigint): void {
  const before = liveIncarnation.value;
  liveIncarnation.value = incarnation;
  if (before === 0n || before === incarnation) return;
  forgetChanges();
  replacements.value++;
  void loadMaps(); // The new map may have another frame.
}

// The errors of a watch whose map does not exist or can't be opened.
const MISSING = [Code.NotFound, Code.FailedPrecondition, Code.DataLoss];
/**
 * The map whose watch has ended with one of these errors, and its incarnation: 0 if there is no such
 * map that can be opened, undefined if it is not known yet.
 */
let missing: { map: string; incarnation: bigint | undefined } | undefined;

/** Watches the shown map again if it was missing and is listed as another incarnation now. */
function watchAgainIfItReturned(): void {
  if (!missing || missing.map !== mapName.value) return;
  const entry = maps.value?.find(({ name }) => name === missing?.map);
  const listed = entry && !entry.problem ? entry.incarnation : 0n;
  const before = missing.incarnation ?? listed;
  missing.incarnation = listed === 0n ? 0n : before;
  if (listed !== 0n && listed !== before) tryAgain();
}

async function follow(map: string, signal: AbortSignal): Promise<void> {
  const follower = new Follower(map);
  const events = watch(
    client.value,
    { scope: { map } },
    {
      signal,
      onState: (state, reason) => {
        status.value = state;
        problem.value = reason?.rawMessage;
        if (state === 'connecting') follower.connecting();
        if (state === 'live') follower.connected();
      },
    },
  );
  try {
    for await (const event of events) follower.take(event);
  } catch (error) {
    if (signal.aborted) return;
    noteFailure(error);
    const { code } = ConnectError.from(error);
    if (!MISSING.includes(code)) return;
    const unseen = code === Code.NotFound ? 0n : undefined;
    missing = { map, incarnation: liveIncarnation.value || unseen };
  }
}

/** The map that is or was watched last. */
let watched: string | undefined;

function startWatch(map: string): () => void {
  const ended = new AbortController();
  batch(() => {
    live.value = new MapContent();
    loading.value = true;
    forgetChanges();
    // A map that is watched again may have been replaced in the meantime.
    if (watched !== map) liveIncarnation.value = watched === undefined ? expected : 0n;
  });
  watched = map;
  missing = undefined;
  void follow(map, ended.signal);
  return () => ended.abort();
}

/** The newest revision that the watch has reported. */
export const liveRevision = computed(() => live.value.revision.value);

const MAPS_EVERY_MS = 5000;

/**
 * Starts to poll the list of maps and to watch the shown map, also when it is missing for a while.
 */
export function start(): void {
  setInterval(() => {
    if (document.hidden || signInWanted.value) return;
    void loadMaps().then(watchAgainIfItReturned);
  }, MAPS_EVERY_MS);
  effect(() => {
    const map = mapName.value;
    client.value; // Restarts the watch with a new client.
    return untracked(() => {
      void loadMaps();
      return map === undefined ? undefined : startWatch(map);
    });
  });
}
