import { type ChildProcess, execFile, spawn } from 'node:child_process';
import { once } from 'node:events';
import { createInterface } from 'node:readline';
import { promisify } from 'node:util';

import { program } from './places.js';

const startDeadlineMs = 20_000;

/** A running program of the build. It is killed when this process exits. */
export class Program {
  readonly #child: ChildProcess;
  readonly #output: string[] = [];
  readonly #killOnExit = () => this.#child.kill('SIGKILL');

  constructor(
    readonly name: string,
    args: string[],
  ) {
    // Detached: it gets a session of its own, as in tests/integration/processes.py.
    this.#child = spawn(program(name), args, {
      stdio: ['ignore', 'pipe', 'pipe'],
      detached: true,
    });
    process.once('exit', this.#killOnExit);
    this.onLine((line) => this.#output.push(line));
  }

  get output(): string {
    return this.#output.join('\n');
  }

  get isRunning(): boolean {
    const { pid, exitCode, signalCode } = this.#child;
    return pid !== undefined && exitCode === null && signalCode === null;
  }

  /** Calls a function with each line that the program prints. */
  onLine(take: (line: string) => void): void {
    for (const stream of [this.#child.stdout, this.#child.stderr]) {
      if (stream) createInterface({ input: stream }).on('line', take);
    }
  }

  /** Calls a function with the reason if the program exits or can't be started. */
  onEnd(take: (why: string) => void): void {
    this.#child.once('error', (error) => take(error.message));
    this.#child.once('exit', (code) => take(`exited with code ${code}`));
  }

  /** Stops the program in the middle of what it does, until it is resumed. */
  pause(): void {
    this.#child.kill('SIGSTOP');
  }

  resume(): void {
    this.#child.kill('SIGCONT');
  }

  /** Sends a signal and waits until the process has exited. */
  async stop(signal: 'SIGTERM' | 'SIGKILL' = 'SIGTERM'): Promise<void> {
    process.off('exit', this.#killOnExit);
    if (!this.isRunning) return;
    const gone = once(this.#child, 'exit');
    this.#child.kill(signal);
    await gone;
  }
}

/** A running server of the build. It is killed when this process exits. */
export class Server {
  private constructor(
    readonly address: string,
    private readonly program: Program,
  ) {}

  /** Starts a program and waits for its line `NAME ready on ADDRESS`. Fails with its output. */
  static async start(name: string, args: string[]): Promise<Server> {
    const program = new Program(name, args);
    try {
      return new Server(await readyAddress(program), program);
    } catch (error) {
      await program.stop('SIGKILL');
      throw error;
    }
  }

  /** Sends a signal and waits until the process has exited. */
  async stop(signal: 'SIGTERM' | 'SIGKILL' = 'SIGTERM'): Promise<void> {
    await this.program.stop(signal);
  }
}

function readyAddress(program: Program): Promise<string> {
  return new Promise((resolve, reject) => {
    const giveUp = (why: string) => reject(new Error(`${program.name} ${why}\n${program.output}`));
    const timer = setTimeout(() => giveUp('was not ready in time'), startDeadlineMs);
    program.onEnd(giveUp);
    program.onLine((line) => {
      const ready = /ready on (\S+)/.exec(line)?.[1];
      if (!ready) return;
      clearTimeout(timer);
      resolve(ready);
    });
  });
}

/** Runs a program to its end and returns its output. Fails with its error output. */
export async function run(name: string, args: string[]): Promise<string> {
  const limits = { maxBuffer: 64 << 20 };
  return (await promisify(execFile)(program(name), args, limits)).stdout;
}
