// Questions to the server about the shown revision. A new question cancels the previous one.
import { signal, type ReadonlySignal } from '@preact/signals';
import { messageOf } from './connection';
import { liveIncarnation } from './live';
import { asOf, atRevision } from './time';

export interface Asking<Answer> {
  /** The answer to the last question; while it is pending, the answer to the previous one. */
  readonly answer: ReadonlySignal<Answer | undefined>;
  /** Whether an answer is pending. */
  readonly busy: ReadonlySignal<boolean>;
  /** The error message of the last question. Undefined if it did not fail. */
  readonly problem: ReadonlySignal<string | undefined>;
  /** Returns the answer; undefined if the question failed or another one has replaced it. */
  ask(question: (signal: AbortSignal) => Promise<Answer>): Promise<Answer | undefined>;
  /** Cancels the pending question and clears the answer. */
  forget(): void;
}

export function asking<Answer>(): Asking<Answer> {
  const answer = signal<Answer>();
  const busy = signal(false);
  const problem = signal<string>();
  let current = new AbortController();

  const replace = (): AbortController => {
    current.abort();
    problem.value = undefined;
    return (current = new AbortController());
  };

  return {
    answer,
    busy,
    problem,
    async ask(question) {
      const mine = replace();
      busy.value = true;
      try {
        const got = await question(mine.signal);
        if (mine !== current) return undefined;
        answer.value = got;
        return got;
      } catch (error) {
        if (mine !== current) return undefined;
        answer.value = undefined;
        problem.value = messageOf(error);
        return undefined;
      } finally {
        if (mine === current) busy.value = false;
      }
    },
    forget() {
      replace();
      busy.value = false;
      answer.value = undefined;
    },
  };
}

/** The map as the field `scope` of a question about the shown revision. */
export function shownScope(map: string) {
  // An earlier revision means something else in another incarnation of the map.
  return { map, incarnation: asOf.peek() === undefined ? 0n : liveIncarnation.peek() };
}

/** The shown revision as the field `asOf` of a question. Undefined for the newest one. */
export function shownRevision() {
  const revision = asOf.peek();
  return revision === undefined ? undefined : atRevision(revision);
}
