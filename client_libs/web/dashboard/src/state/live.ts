// The live content of the shown map: one watch for the whole page, as browsers allow few connections.
import { isTransient, watch, type WatchEvent } from '@hypermap/client';
import { batch, computed, effect, signal, untracked } from '@preact/signals';
import { forgetChanges, noteChanges } from './changes';
import { client, noteFailure, problem, status } from './connection';
import { MapContent } from './map_content';
import { ChangeKind } from './model';
import { loadLayers, loadMaps, mapName } from './site';

/** Another one after the map or all of its content became another. */
export const live = signal(new MapContent());
/** Whether the first content of the map is still on its way. */
export const loading = signal(true);

const LAYER_CHANGES = [
  ChangeKind.LAYER_CREATED,
  ChangeKind.LAYER_DELETED,
  ChangeKind.LAYER_CHANGED,
];

/** Where a map's content is put together, event by event. */
class Follower {
  // A snapshot is put together aside while there is something to be seen already.
  #content = live.value;
  #inSnapshot = false;

  constructor(private readonly map: string) {}

  /** What was told of a snapshot by halves is told again from its beginning. */
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

  // When the server can't be reached just now, the next connection asks again.
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

async function follow(map: string, signal: AbortSignal): Promise<void> {
  const follower = new Follower(map);
  const events = watch(
    client.value,
    { map },
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
    if (!signal.aborted) noteFailure(error);
  }
}

function startWatch(map: string): () => void {
  const ended = new AbortController();
  batch(() => {
    live.value = new MapContent();
    loading.value = true;
    forgetChanges();
  });
  void follow(map, ended.signal);
  return () => ended.abort();
}

/** The newest revision that was told. */
export const liveRevision = computed(() => live.value.revision.value);

const MAPS_EVERY_MS = 5000;

/** Begins to follow the server: its list of maps, and the shown map. */
export function start(): void {
  setInterval(() => {
    if (!document.hidden) void loadMaps();
  }, MAPS_EVERY_MS);
  effect(() => {
    const map = mapName.value;
    client.value; // again with another token
    return untracked(() => {
      void loadMaps();
      return map === undefined ? undefined : startWatch(map);
    });
  });
}
