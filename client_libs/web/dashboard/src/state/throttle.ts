/**
 * Runs a function on request, never twice at once, and starts it at most once per interval.
 * Requests during a run or a pause are served by one more run afterwards.
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

  /** Prevents further runs. A run that has begun is not interrupted. */
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
