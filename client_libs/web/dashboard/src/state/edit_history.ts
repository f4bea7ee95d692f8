// What was done to objects, and the way back and forth.
import type { Object$ } from './model';

/** What becomes of one object. */
export interface ObjectEdit {
  /** For people: "draw chair". */
  title: string;
  layer: string;
  /** Undefined: it was not there. */
  before: Object$ | undefined;
  /** Undefined: it is taken away. */
  after: Object$ | undefined;
}

/** One edit as the server takes it: put an object (id 0: a new one), or delete one. */
export interface WantedEdit {
  layer: string;
  id: bigint;
  /** What the object must not have changed since. Undefined for a new one. */
  version: bigint | undefined;
  /** Undefined: delete. */
  object: Object$ | undefined;
}

/** Carries an edit out; tells the object's id and the revision. When it rejects, nothing was changed. */
export type Apply = (edit: WantedEdit) => Promise<{ id: bigint; revision: bigint }>;

// An object that is deleted and put back is another one to the server: steps hold what stays.
interface Subject {
  id: bigint;
  version: bigint;
}

interface Step extends ObjectEdit {
  subject: Subject;
}

/** The object is not any more as an edit or its undoing takes it to be. */
export class StaleEdit extends Error {}

const LONGEST = 100;

/**
 * Edits of objects in the order they were made. One at a time: wait for the answer before the next.
 * A step that is stale is forgotten: what it would go back from is not there any more.
 */
export class EditHistory {
  #done: Step[] = [];
  #undone: Step[] = [];

  constructor(private readonly apply: Apply) {}

  /** What would be undone next. */
  get undoTitle(): string | undefined {
    return this.#done.at(-1)?.title;
  }

  get redoTitle(): string | undefined {
    return this.#undone.at(-1)?.title;
  }

  /** Carries an edit out. Returns the id of the object. */
  async do(edit: ObjectEdit): Promise<bigint> {
    const step = { ...edit, subject: this.#subjectOf(edit.before) };
    await this.#carryOut(step, edit.after);
    this.#done.push(step);
    this.#done = this.#done.slice(-LONGEST);
    this.#undone = [];
    return step.subject.id;
  }

  /** Takes the last edit back. Returns the id of the object, undefined when there was nothing to undo. */
  async undo(): Promise<bigint | undefined> {
    return this.#move(this.#done, this.#undone, 'before');
  }

  async redo(): Promise<bigint | undefined> {
    return this.#move(this.#undone, this.#done, 'after');
  }

  forget(): void {
    this.#done = [];
    this.#undone = [];
  }

  async #move(from: Step[], to: Step[], state: 'before' | 'after'): Promise<bigint | undefined> {
    const step = from.at(-1);
    if (!step) return undefined;
    try {
      await this.#carryOut(step, step[state]);
    } catch (error) {
      if (error instanceof StaleEdit) from.pop();
      throw error;
    }
    from.pop();
    to.push(step);
    return step.subject.id;
  }

  // The newest step on an object knows its id now; its version is that of the map's, which somebody
  // else may have changed since.
  #subjectOf(before: Object$ | undefined): Subject {
    if (!before) return { id: 0n, version: 0n };
    const steps = [...this.#done, ...this.#undone];
    const subject = steps.find((step) => step.subject.id === before.id)?.subject;
    if (!subject) return { id: before.id, version: before.version };
    subject.version = before.version;
    return subject;
  }

  async #carryOut({ layer, subject }: Step, object: Object$ | undefined): Promise<void> {
    const there = subject.id !== 0n;
    const version = there ? subject.version : undefined;
    const { id, revision } = await this.apply({ layer, id: subject.id, version, object });
    subject.id = object ? id : 0n;
    subject.version = revision;
  }
}
