import { effect, untracked } from '@preact/signals';
import { find, refreshAnswer } from './find';
import { point, refreshPoint } from './point';
import { mapName } from './site';
import { Throttle } from './throttle';
import { asOf, shown } from './time';

/** People read slower than robots work. */
const EVERY_MS = 1000;

/** Keeps answers to the map and the time that are shown. */
export function startQuestions(): void {
  const pointAgain = new Throttle(EVERY_MS, refreshPoint);
  const answerAgain = new Throttle(EVERY_MS, refreshAnswer);
  effect(() => {
    mapName.value; // answers belong to the map before
    untracked(() => {
      find.forget();
      point.forget();
    });
  });
  effect(() => {
    asOf.value;
    untracked(() => answerAgain.ask());
  });
  // What is at a point is little, and always as it is now; long answers wait to be asked for.
  effect(() => {
    shown.value.revision.value;
    untracked(() => pointAgain.ask());
  });
}
