import type { Site } from './site.js';

const places = [
  { robot: 'robot-1', pose: { x: 1.8, y: 2.9 } },
  { robot: 'robot-2', pose: { x: 9.5, y: 2.9 } },
  { robot: 'robot-3', pose: { x: 10.6, y: 6.2 } },
];

/** Claims goals for three robots, with leases that outlast the test. */
export async function claimGoals(site: Site): Promise<void> {
  for (const { robot, pose } of places) {
    const lease = { seconds: 600n };
    await site.client().exploration.claimGoal({ map: 'office', robot, pose, lease });
  }
}
