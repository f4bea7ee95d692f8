/**
 * Runs something each time it is asked to, but never twice at once, and begins at most once in so
 * many milliseconds. What is asked for meanwhile is one more run, later.
 */
export class Throttle {
  #busy = false;
  #again = false;
  #ended = false;

  constructor(
    private readonly everyMs: number,
    private readonly run: () => Promise<void>,
  ) {}

  ask(): void {
    this.#again = true;
    if (!this.#busy && !this.#ended) void this.#work();
  }

  /** A run that is under way ends by itself. */
  end(): void {
    this.#ended = true;
  }

  async #work(): Promise<void> {
    this.#busy = true;
    while (this.#again && !this.#ended) {
      this.#again = false;
      const pause = new Promise((resolve) => setTimeout(resolve, this.everyMs));
      await this.run();
      await pause;
    }
    this.#busy = false;
  }
}
