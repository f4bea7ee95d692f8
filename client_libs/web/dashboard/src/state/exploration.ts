// The chosen exploration: its progress, the goals of robots and the frontiers that are left.
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

// The server keeps explorations as objects with this label on this layer.
const LAYER = 'explorations';
const LABEL = 'exploration';

/** The state of an exploration at one moment, as the server reports it. */
export interface ExplorationReport {
  exploration: Exploration;
  progress: ExplorationProgress;
  frontiers: readonly Frontier[];
}

/** The explorations of the map, newest first. */
export const explorations = computed<readonly Object$[]>(() => {
  live.value.revision.value; // Recomputed after each commit.
  const objects = [...live.value.objects(LAYER).values()];
  return objects.filter(({ label }) => label === LABEL).sort((a, b) => Number(b.id - a.id));
});

/** The id of the exploration that the user chose. Undefined for the newest one. */
export const wantedExploration = signal<bigint>();

const lookedAt = computed(() => {
  const found = explorations.value.find(({ id }) => id === wantedExploration.value);
  return (found ?? explorations.value[0])?.id;
});

/** Undefined until the server has answered and while no panel shows it. */
export const explorationReport = signal<ExplorationReport>();
/** The error message of the last report. */
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
    // The exploration was stopped or deleted between the two calls. The watch reports that change,
    // and the report is loaded again.
    const { code } = ConnectError.from(error);
    if (code === Code.NotFound || code === Code.FailedPrecondition) return;
    explorationProblem.value = messageOf(error);
  }
}

/** The minimum interval between reports: for each one the server scans the whole floor twice. */
const EVERY_MS = 1000;

/** Keeps the report up to date until the returned function is called. */
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
