import { effect, untracked } from '@preact/signals';
import { find, refreshAnswer } from './find';
import { point, refreshPoint } from './point';
import { replacements } from './live';
import { mapName } from './site';
import { Throttle } from './throttle';
import { asOf, shown } from './time';

/** The minimum interval between updates of an answer; robots may change the map more often. */
const EVERY_MS = 1000;

/** Keeps the answers in step with the shown map and revision. */
export function startQuestions(): void {
  const pointAgain = new Throttle(EVERY_MS, refreshPoint);
  const answerAgain = new Throttle(EVERY_MS, refreshAnswer);
  effect(() => {
    mapName.value; // Answers about the previous map are dropped.
    replacements.value;
    untracked(() => {
      find.forget();
      point.forget();
    });
  });
  effect(() => {
    asOf.value;
    untracked(() => answerAgain.ask());
  });
  // A point query is cheap and is repeated after each commit. A search may have a long answer, so
  // its panel offers a button to repeat it.
  effect(() => {
    shown.value.revision.value;
    untracked(() => pointAgain.ask());
  });
}
