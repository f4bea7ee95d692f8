// The exploration that is looked at: how far it has come, where robots go, what is left to see.
import {
  Code,
  ConnectError,
  ExplorationState,
  type Exploration,
  type ExplorationProgress,
  type Frontier,
} from '@hypermap/client';
import { computed, effect, signal, untracked } from '@preact/signals';
import { client, messageOf } from './connection';
import { live } from './live';
import type { Object$ } from './model';
import { mapName } from './site';
import { Throttle } from './throttle';

// Of the server: explorations are objects of an ordinary layer.
const LAYER = 'explorations';
const LABEL = 'exploration';

/** What is asked of the server about an exploration, of one moment. */
export interface ExplorationReport {
  exploration: Exploration;
  progress: ExplorationProgress;
  frontiers: readonly Frontier[];
}

/** The explorations of the map, the newest first. */
export const explorations = computed<readonly Object$[]>(() => {
  live.value.revision.value; // again after each step
  const objects = [...live.value.objects(LAYER).values()];
  return objects.filter(({ label }) => label === LABEL).sort((a, b) => Number(b.id - a.id));
});

/** Undefined: the newest. */
export const wantedExploration = signal<bigint>();

const lookedAt = computed(() => {
  const found = explorations.value.find(({ id }) => id === wantedExploration.value);
  return (found ?? explorations.value[0])?.id;
});

/** Undefined until the server told it, and while nobody looks. */
export const explorationReport = signal<ExplorationReport>();
/** Why there is none. */
export const explorationProblem = signal<string>();

async function ask(map: string, explorationId: bigint): Promise<ExplorationReport | undefined> {
  const { exploration: service } = client.value;
  const { exploration, progress } = await service.getExploration({ map, explorationId });
  if (!exploration || !progress) return undefined;
  if (exploration.state === ExplorationState.ENDED) return { exploration, progress, frontiers: [] };
  const request = { map, explorationId, withCells: true };
  const { frontiers } = await service.listFrontiers(request);
  return { exploration, progress, frontiers };
}

async function load(): Promise<void> {
  const map = mapName.value;
  const id = lookedAt.value;
  try {
    const report = map !== undefined && id !== undefined ? await ask(map, id) : undefined;
    if (map !== mapName.value) return;
    explorationReport.value = report;
    explorationProblem.value = undefined;
  } catch (error) {
    // Stopped or deleted between the two questions: the change is told, and it is asked again.
    const { code } = ConnectError.from(error);
    if (code === Code.NotFound || code === Code.FailedPrecondition) return;
    explorationProblem.value = messageOf(error);
  }
}

/** Both answers cost the server a look at the whole floor. */
const EVERY_MS = 1000;

/** Keeps the report up to date while somebody looks, until what is returned is called. */
export function followExploration(): () => void {
  const throttle = new Throttle(EVERY_MS, load);
  const stop = effect(() => {
    live.value.revision.value;
    lookedAt.value;
    untracked(() => throttle.ask());
  });
  return () => {
    stop();
    throttle.end();
    explorationReport.value = undefined;
  };
}
