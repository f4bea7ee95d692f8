// Lays another map, the source, over the shown map, the target: the layers to compare, the estimated
// transform, and its application.
import {
  TransformAmbiguity,
  type EstimateTransformInput,
  type EstimateTransformRequestSchema,
  type EstimateTransformResponse,
  type MessageInitShape,
} from '@hypermap/client';
import { batch, computed, effect, signal, untracked } from '@preact/signals';
import { asking } from './asking';
import { may } from './caller';
import { client } from './connection';
import { liveIncarnation, replacements } from './live';
import { LayerKind, MapState, type Layer } from './model';
import { OF_THE_SERVER } from './objects';
import { loadOverlay, overlay } from './overlay';
import { forgetPairs, pairs, type PlacePair } from './place_pairs';
import { IDENTITY, transform, type Pose2 } from './rigid';
import { layers, mapName, maps } from './site';

/** The kinds of layers that the server compares, the better ones first. */
const COMPARED_KINDS = [LayerKind.OCCUPANCY, LayerKind.SEMANTIC];

/** Whether the panel is open. The overlay is loaded and drawn only then. */
export const aligning = signal(false);

const wantedSource = signal<string>();
const wantedSourceLayer = signal<string>();
const wantedTargetLayer = signal<string>();

/** The names of the maps that can be laid over the shown one. */
export const otherMaps = computed(() =>
  (maps.value ?? [])
    .filter(({ name, state }) => name !== mapName.value && state !== MapState.CLOSED)
    .map(({ name }) => name),
);

/** The map that is laid over the shown one. Undefined until the user has chosen it. */
export const sourceMap = computed(() =>
  otherMaps.value.find((name) => name === wantedSource.value),
);

/** The layers of the source. */
export const sourceLayers = asking<{ map: string; layers: readonly Layer[] }>();

function compared(of: readonly Layer[]): Layer[] {
  return of
    .filter(({ kind, name }) => COMPARED_KINDS.includes(kind) && name !== OF_THE_SERVER)
    .sort(
      (a, b) =>
        COMPARED_KINDS.indexOf(a.kind) - COMPARED_KINDS.indexOf(b.kind) ||
        a.name.localeCompare(b.name),
    );
}

function chosen(from: readonly Layer[], wanted: string | undefined): Layer | undefined {
  return from.find(({ name }) => name === wanted) ?? from[0];
}

/** The layers of the source of a kind that the target has too. */
export const sourceChoice = computed<readonly Layer[]>(() => {
  const known = sourceLayers.answer.value;
  if (!known || known.map !== sourceMap.value) return [];
  const kinds = compared(layers.value ?? []).map(({ kind }) => kind);
  return compared(known.layers).filter(({ kind }) => kinds.includes(kind));
});
export const sourceLayer = computed(() => chosen(sourceChoice.value, wantedSourceLayer.value));

/** The layers of the target of the same kind as the source's. */
export const targetChoice = computed<readonly Layer[]>(() =>
  compared(layers.value ?? []).filter(({ kind }) => kind === sourceLayer.value?.kind),
);
export const targetLayer = computed(() =>
  chosen(targetChoice.value, wantedTargetLayer.value ?? sourceLayer.value?.name),
);

/** An answer of the server, with all that is always there. */
export interface Estimate {
  source: EstimateTransformInput;
  target: EstimateTransformInput;
  best: Pose2;
  score: number;
  /** The pairs that it was made from. Empty for an estimate from layers. */
  pairs: readonly PlacePair[];
  response: EstimateTransformResponse;
}

export const estimate = asking<Estimate>();

/** How the overlay lies: the last estimate, at first the identity. */
export const placement = signal<Pose2>(IDENTITY);

/** Whether the user wants to apply an ambiguous estimate. */
export const applyAllTheSame = signal(false);

/** A frame that was set in the target. */
export interface Applied {
  childFrameId: string;
  parentFrameId: string;
  revision: bigint;
}

export const applied = asking<Applied>();

function forgetEstimate(): void {
  estimate.forget();
  applied.forget();
  applyAllTheSame.value = false;
}

/** Chooses the map to lay over the shown one; undefined for none. */
export function chooseSource(map: string | undefined): void {
  batch(() => {
    forgetEstimate();
    overlay.forget();
    forgetPairs();
    placement.value = IDENTITY;
    wantedSource.value = map;
    wantedSourceLayer.value = wantedTargetLayer.value = undefined;
  });
}

export function chooseSourceLayer(name: string): void {
  wantedSourceLayer.value = name;
}

export function chooseTargetLayer(name: string): void {
  wantedTargetLayer.value = name;
}

function estimateOf(response: EstimateTransformResponse, from: readonly PlacePair[]): Estimate {
  const { source, target, best } = response;
  const pose = best?.targetFromSource;
  if (!source || !target || !pose) throw new Error('the answer of the server is incomplete');
  return { source, target, best: pose, score: best.score, pairs: from, response };
}

type Request = MessageInitShape<typeof EstimateTransformRequestSchema>;

/** Asks for an estimate, and lays the overlay in its place, as it was when it was compared. */
async function ask(request: Request, from: readonly PlacePair[] = []): Promise<void> {
  applied.forget();
  applyAllTheSame.value = false;
  const answer = await estimate.ask(async (abort) =>
    estimateOf(await client.value.query.estimateTransform(request, { signal: abort }), from),
  );
  if (!answer) return;
  placement.value = answer.best;
  const { map, revision, incarnation } = answer.source;
  const layer = sourceLayer.peek();
  if (layer && overlay.answer.peek()?.revision !== revision) {
    await loadOverlay(map, layer, { revision, incarnation });
  }
}

/** Estimates the transform by comparing the chosen layers. */
export async function estimateFromLayers(): Promise<void> {
  const [from, to] = [sourceLayer.peek(), targetLayer.peek()];
  const [source, target] = [sourceMap.peek(), mapName.peek()];
  if (source === undefined || target === undefined || !from || !to) return;
  await ask({
    source: { scope: { map: source, layers: [from.name] } },
    target: { scope: { map: target, layers: [to.name], incarnation: liveIncarnation.peek() } },
  });
}

/** The server estimates from this many pairs on. */
export const LEAST_PAIRS = 2;

/** Estimates the transform from the pairs of places. */
export async function estimateFromPairs(): Promise<void> {
  const [source, target] = [sourceMap.peek(), mapName.peek()];
  const from = pairs.peek();
  if (source === undefined || target === undefined || from.length < LEAST_PAIRS) return;
  const request = {
    source: { scope: { map: source } },
    target: { scope: { map: target, incarnation: liveIncarnation.peek() } },
    pairs: from.map((pair, i) => ({
      name: `${i + 1}`,
      source: { x: pair.source[0], y: pair.source[1] },
      target: { x: pair.target[0], y: pair.target[1] },
    })),
  };
  await ask(request, from);
}

/** What an estimate says of one of its pairs. */
export interface PairResult {
  agrees: boolean;
  /** The distance between the target's place and that of the transformed source's, metres. */
  residualM: number;
}

/** Undefined if the estimate was not made from the pair. */
export function resultOf(answer: Estimate, pair: PlacePair): PairResult | undefined {
  const index = answer.pairs.indexOf(pair);
  if (index < 0) return undefined;
  const agreeing = answer.response.agreeing.find(({ source }) => source === BigInt(index));
  if (agreeing) return { agrees: true, residualM: agreeing.residualM };
  // The answer has the residuals of those that agree only.
  const [x, y] = transform(answer.best, pair.source);
  return { agrees: false, residualM: Math.hypot(x - pair.target[0], y - pair.target[1]) };
}

export function isAmbiguous({ response }: Estimate): boolean {
  return response.ambiguity !== TransformAmbiguity.NONE;
}

/** The standard deviations of the best transform. Undefined if its covariance is infinite. */
export function deviationsOf({ response: { covariance } }: Estimate): Pose2 | undefined {
  if (covariance.length === 0) return undefined;
  const [x = NaN, y = NaN, yaw = NaN] = [0, 4, 8].map((i) => Math.sqrt(covariance[i] ?? NaN));
  return { x, y, yaw };
}

/** The name that the source's frame gets in the target: its own, unless the target's is the same. */
export function childFrameOf({ source, target }: Estimate): string {
  return source.frameId === target.frameId ? source.map : source.frameId;
}

/** Why the estimate can't be applied. Undefined if it can. */
export const applyObstacle = computed<'role' | 'ambiguous' | undefined>(() => {
  if (!may('CatalogService/SetTransform')) return 'role';
  const answer = estimate.answer.value;
  return answer && isAmbiguous(answer) && !applyAllTheSame.value ? 'ambiguous' : undefined;
});

/** Sets the frame of the source in the target, so that its layers in this frame lie in their place. */
export async function applyEstimate(): Promise<void> {
  const answer = estimate.answer.peek();
  if (!answer || applyObstacle.peek() !== undefined) return;
  const { target, best } = answer;
  const parentFrameId = target.frameId;
  const childFrameId = childFrameOf(answer);
  await applied.ask(async (abort) => {
    const request = {
      map: target.map,
      incarnation: target.incarnation,
      transform: { parentFrameId, childFrameId, parentFromChild: best },
    };
    const { revision } = await client.value.catalog.setTransform(request, { signal: abort });
    return { childFrameId, parentFrameId, revision };
  });
}

/** Loads the source's layers and the overlay as they are chosen, until the returned function is called. */
export function followAlignment(): () => void {
  aligning.value = true;
  const stopLayers = effect(() => {
    const map = sourceMap.value;
    if (map === undefined) return;
    untracked(() => {
      void sourceLayers.ask(async (abort) => {
        const answer = await client.value.catalog.listLayers({ map }, { signal: abort });
        return { map, layers: answer.layers };
      });
    });
  });
  // The list of layers is replaced often, the overlay is not loaded again for that.
  const key = computed(() => `${sourceMap.value}\n${sourceLayer.value?.name}`);
  const stopOverlay = effect(() => {
    key.value;
    untracked(() => {
      const [map, layer] = [sourceMap.value, sourceLayer.value];
      if (map === undefined || !layer) overlay.forget();
      else void loadOverlay(map, layer);
    });
  });
  return () => {
    stopLayers();
    stopOverlay();
    aligning.value = false;
  };
}

/** Forgets the source whenever another map is shown, or has replaced the shown one. */
export function startAlign(): void {
  effect(() => {
    mapName.value;
    replacements.value;
    untracked(() => chooseSource(undefined));
  });
}
