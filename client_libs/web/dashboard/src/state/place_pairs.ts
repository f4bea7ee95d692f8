// Places that the user has clicked in both maps.
import { batch, signal } from '@preact/signals';
import type { Position } from './model';
import { transformBack, type Pose2 } from './rigid';

/** The same place in the frames of both maps, metres. */
export interface PlacePair {
  source: Position;
  target: Position;
}

export const pairs = signal<readonly PlacePair[]>([]);

/** The place in the source, in its frame, whose place in the target the user has not clicked yet. */
export const begunPair = signal<Position>();

/** Begins a pair with a place on the overlay, which lies in the target at `placement`. */
export function beginPair(onOverlay: Position, placement: Pose2): void {
  begunPair.value = transformBack(placement, onOverlay);
}

/** Ends the pair with the place in the target where the begun one belongs. */
export function endPair(target: Position): void {
  const source = begunPair.peek();
  if (!source) return;
  batch(() => {
    begunPair.value = undefined;
    pairs.value = [...pairs.peek(), { source, target }];
  });
}

export function dropBegunPair(): void {
  begunPair.value = undefined;
}

export function removePair(pair: PlacePair): void {
  pairs.value = pairs.peek().filter((each) => each !== pair);
}

export function forgetPairs(): void {
  batch(() => {
    pairs.value = [];
    begunPair.value = undefined;
  });
}
