import { timestampDate, type Goal, type RobotPresence } from '@hypermap/client';
import { expect } from '@playwright/test';

import type { Place } from './dashboard.js';
import { Program } from './programs.js';
import type { Site } from './site.js';

const places = [
  { robot: 'robot-1', pose: { x: 1.8, y: 2.9 } },
  { robot: 'robot-2', pose: { x: 9.5, y: 2.9 } },
  { robot: 'robot-3', pose: { x: 10.6, y: 6.2 } },
];

/** Longer than a test takes. */
const LEASE = { seconds: 600n };

/** Claims goals for three robots, with leases that outlast the test. */
export async function claimGoals(site: Site): Promise<void> {
  for (const { robot, pose } of places) {
    await site.client().exploration.claimGoal({ map: 'office', robot, pose, lease: LEASE });
  }
}

/** What the server knows of a robot of the office. */
export interface KnownRobot {
  name: string;
  position: Place;
  /** Radians, counter-clockwise from the x axis. */
  yaw: number;
  online: boolean;
  seen: Date;
  /** The goal that the newest exploration has leased to it. */
  goal: Place | undefined;
}

function knownRobot({ report, online, seenTime }: RobotPresence, goals: Goal[]): KnownRobot {
  const { x = NaN, y = NaN, yaw = NaN } = report?.pose ?? {};
  const name = report?.robot ?? '';
  const goal = goals.find(({ robot }) => robot === name)?.position;
  return {
    name,
    position: [x, y],
    yaw,
    online,
    seen: seenTime ? timestampDate(seenTime) : new Date(NaN),
    goal: goal && [goal.x, goal.y],
  };
}

/** Asks the server for the robots of the office, sorted by name. */
export async function knownRobots(site: Site): Promise<KnownRobot[]> {
  const { robots } = await site.client().robots.listRobots({ map: 'office' });
  const goals = robots.length > 0 ? await goalsOf(site) : [];
  return robots.map((robot) => knownRobot(robot, goals));
}

async function goalsOf(site: Site): Promise<Goal[]> {
  const { exploration } = await site.client().exploration.getExploration({ map: 'office' });
  return exploration?.goals ?? [];
}

/** Three robots of `hypermap-ingest simulate`, which explore the office and tell where they are. */
export class SimulatedRobots {
  readonly #program: Program;

  constructor(private readonly site: Site) {
    this.#program = new Program('hypermap-ingest', [
      ...['simulate', '--server', site.address, '--map', 'office'],
      ...['--occupancy', 'floor', '--objects', 'objects,dock'],
      ...['--area', '0.2,0.2', '14.6,0.2', '14.6,11.8', '0.2,11.8'],
      ...['--start', '1.8,2.9', '9.5,2.9', '10.6,6.2', '--robots', '3', '--seed', '1'],
      ...['--layer', 'found', '--explored', 'explored'],
    ]);
  }

  /**
   * Lets the robots drive until a condition holds, then stops them in the middle of what they do:
   * they report nothing until this is called again, and keep their goals.
   */
  async driveUntil(holds: (robots: KnownRobot[]) => boolean): Promise<KnownRobot[]> {
    for (;;) {
      this.#program.resume();
      await expect.poll(async () => holds(await this.#known()), { intervals: [20] }).toBe(true);
      this.#program.pause();
      // They have driven on since the server was asked.
      const robots = await this.#known();
      if (!holds(robots)) continue;
      await this.#keepGoals();
      return robots;
    }
  }

  /** Ends the program at once, so that nobody tells the server of the end. */
  async kill(): Promise<void> {
    await this.#program.stop('SIGKILL');
  }

  async #known(): Promise<KnownRobot[]> {
    if (!this.#program.isRunning) throw new Error(`the robots have ended\n${this.#program.output}`);
    return knownRobots(this.site);
  }

  async #keepGoals(): Promise<void> {
    for (const { robot, id } of await goalsOf(this.site)) {
      const lease = LEASE;
      await this.site.client().exploration.renewGoal({ map: 'office', robot, goalId: id, lease });
    }
  }
}
