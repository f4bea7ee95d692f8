// Questions to the server, of the revision that is shown. A new question takes the place of the one
// before it.
import { signal, type ReadonlySignal } from '@preact/signals';
import { messageOf } from './connection';
import { asOf } from './time';

export interface Asking<Answer> {
  /** Of the last question; that of the one before stays until it is there. */
  readonly answer: ReadonlySignal<Answer | undefined>;
  readonly busy: ReadonlySignal<boolean>;
  /** Why the last question has no answer. */
  readonly problem: ReadonlySignal<string | undefined>;
  /** Returns the answer, unless there is none or another question was asked meanwhile. */
  ask(question: (signal: AbortSignal) => Promise<Answer>): Promise<Answer | undefined>;
  /** Forgets question and answer. */
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

/** The revision that is shown, as questions name it. */
export function shownRevision() {
  const revision = asOf.peek();
  return revision === undefined
    ? { case: undefined }
    : ({ case: 'atRevision', value: revision } as const);
}
