// The origin of the selected object: its last commit and the observations that it was fused from.
import {
  Code,
  ConnectError,
  type ExplainObjectResponse,
  type RevisionInfo,
} from '@hypermap/client';
import { effect, untracked } from '@preact/signals';
import { asking } from './asking';
import { client } from './connection';
import { liveIncarnation } from './live';
import { selected } from './selection';
import { mapName } from './site';
import { Throttle } from './throttle';

export interface Evidence {
  objectId: bigint;
  /** The commit that made the object's current version. Undefined when it has been compacted. */
  commit: RevisionInfo | undefined;
  /** Undefined for an object that was not fused from observations. */
  explanation: ExplainObjectResponse | undefined;
}

export const evidence = asking<Evidence>();

/**
 * Robots may observe an object many times per second; the panel is updated no more often than this.
 */
const EVERY_MS = 1000;

async function explain(
  map: string,
  layer: string,
  objectId: bigint,
  signal: AbortSignal,
): Promise<ExplainObjectResponse | undefined> {
  try {
    return await client.value.ingest.explainObject({ map, layer, objectId }, { signal });
  } catch (error) {
    const { code } = ConnectError.from(error);
    if (code === Code.NotFound || code === Code.FailedPrecondition) return undefined;
    throw error;
  }
}

async function commitOf(
  map: string,
  revision: bigint,
  signal: AbortSignal,
): Promise<RevisionInfo | undefined> {
  const incarnation = liveIncarnation.peek();
  const request = { map, incarnation, afterRevision: revision - 1n, pageSize: 1 };
  const { revisions } = await client.value.changes.listRevisions(request, { signal });
  return revisions.find((info) => info.revision === revision);
}

async function refresh(): Promise<void> {
  const map = mapName.peek();
  const of = selected.peek();
  if (map === undefined || !of) {
    evidence.forget();
    return;
  }
  const { layer, object } = of;
  if (evidence.answer.peek()?.objectId !== object.id) evidence.forget();
  await evidence.ask(async (signal) => {
    const [commit, explanation] = await Promise.all([
      commitOf(map, object.version, signal),
      explain(map, layer, object.id, signal),
    ]);
    return { objectId: object.id, commit, explanation };
  });
}

/** Keeps the evidence of the selected object up to date until the returned function is called. */
export function followEvidence(): () => void {
  const throttle = new Throttle(EVERY_MS, refresh);
  const stop = effect(() => {
    selected.value?.object.version; // Runs again for each new version of the object.
    untracked(() => throttle.ask());
  });
  return () => {
    stop();
    throttle.end();
  };
}
