// The undo history of object edits.
import type { Object$ } from './model';

/** A change of one object: it is created, replaced or deleted. */
export interface ObjectEdit {
  /** Text for the undo button: "draw chair". */
  title: string;
  layer: string;
  /** The object before the edit. Undefined when the edit creates it. */
  before: Object$ | undefined;
  /** The object after the edit. Undefined when the edit deletes it. */
  after: Object$ | undefined;
}

/** One edit as the server accepts it: puts an object (id 0 creates one) or deletes one. */
export interface WantedEdit {
  layer: string;
  id: bigint;
  /** The edit fails if the object's version differs from this one. Undefined for a new object. */
  version: bigint | undefined;
  /** The new state of the object. Undefined to delete it. */
  object: Object$ | undefined;
}

/**
 * Applies an edit; returns the object's id and the revision. If it rejects, nothing was changed.
 */
export type Apply = (edit: WantedEdit) => Promise<{ id: bigint; revision: bigint }>;

// The server gives a new id to an object that is deleted and put back. All steps on one object
// share a Subject, which has its current id.
interface Subject {
  id: bigint;
  version: bigint;
}

interface Step extends ObjectEdit {
  subject: Subject;
}

/** Somebody else changed or deleted the object that an edit, undo or redo is about. */
export class StaleEdit extends Error {}

/** The number of edits that can be undone. */
const LONGEST = 100;

/**
 * The edits of objects in the order in which they were made. Callers await each call before the
 * next one. A step that fails with StaleEdit is dropped, because the state that it would restore
 * from is gone.
 */
export class EditHistory {
  #done: Step[] = [];
  #undone: Step[] = [];

  constructor(private readonly apply: Apply) {}

  /** The title of the edit that `undo` would revert. */
  get undoTitle(): string | undefined {
    return this.#done.at(-1)?.title;
  }

  /** The title of the edit that `redo` would repeat. */
  get redoTitle(): string | undefined {
    return this.#undone.at(-1)?.title;
  }

  /** Applies an edit. Returns the id of the object. */
  async do(edit: ObjectEdit): Promise<bigint> {
    const step = { ...edit, subject: this.#subjectOf(edit.before) };
    await this.#carryOut(step, edit.after);
    this.#done.push(step);
    this.#done = this.#done.slice(-LONGEST);
    this.#undone = [];
    return step.subject.id;
  }

  /**
   * Reverts the last edit. Returns the id of the object; undefined if there was nothing to undo.
   */
  async undo(): Promise<bigint | undefined> {
    return this.#move(this.#done, this.#undone, 'before');
  }

  /** Repeats the edit that was undone last. Returns the same as `undo`. */
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

  // Steps on the same object share its current id. The version comes from the map, because somebody
  // else may have changed the object since the last step.
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
