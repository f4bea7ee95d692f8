import { type ChildProcess, execFile, spawn } from 'node:child_process';
import { once } from 'node:events';
import { createInterface } from 'node:readline';
import { promisify } from 'node:util';

import { program } from './places.js';

const startDeadlineMs = 20_000;

/** A running server of the build. It is killed when this process exits. */
export class Server {
  private constructor(
    readonly address: string,
    private readonly child: ChildProcess,
    private readonly killOnExit: () => void,
  ) {}

  /** Starts a program and waits for its line `NAME ready on ADDRESS`. Fails with its output. */
  static async start(name: string, args: string[]): Promise<Server> {
    // Detached: it gets a session of its own, as in tests/integration/processes.py.
    const child = spawn(program(name), args, { stdio: ['ignore', 'pipe', 'pipe'], detached: true });
    const killOnExit = () => child.kill('SIGKILL');
    process.once('exit', killOnExit);
    try {
      return new Server(await readyAddress(name, child), child, killOnExit);
    } catch (error) {
      child.kill('SIGKILL');
      throw error;
    }
  }

  /** Sends a signal and waits until the process has exited. */
  async stop(signal: 'SIGTERM' | 'SIGKILL' = 'SIGTERM'): Promise<void> {
    process.off('exit', this.killOnExit);
    if (this.child.exitCode !== null || this.child.signalCode !== null) return;
    const gone = once(this.child, 'exit');
    this.child.kill(signal);
    await gone;
  }
}

function readyAddress(name: string, child: ChildProcess): Promise<string> {
  return new Promise((resolve, reject) => {
    const output: string[] = [];
    const giveUp = (why: string) => reject(new Error(`${name} ${why}\n${output.join('\n')}`));
    const timer = setTimeout(() => giveUp('was not ready in time'), startDeadlineMs);
    child.once('error', (error) => giveUp(error.message));
    child.once('exit', (code) => giveUp(`exited with code ${code}`));
    for (const stream of [child.stdout, child.stderr]) {
      if (!stream) continue;
      createInterface({ input: stream }).on('line', (line) => {
        output.push(line);
        const ready = /ready on (\S+)/.exec(line)?.[1];
        if (!ready) return;
        clearTimeout(timer);
        resolve(ready);
      });
    }
  });
}

/** Runs a program to its end and returns its output. Fails with its error output. */
export async function run(name: string, args: string[]): Promise<string> {
  const limits = { maxBuffer: 64 << 20 };
  return (await promisify(execFile)(program(name), args, limits)).stdout;
}
