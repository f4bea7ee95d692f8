import { timestampFromDate } from '@hypermap/client';

import { claimGoals } from '../support/robots.js';
import type { Site } from '../support/site.js';
import { expect, shot, test } from '../support/test.js';

/** Tells the server where a robot is. */
async function report(site: Site, robot: string, x: number, y: number, yaw = 0): Promise<void> {
  const stamp = timestampFromDate(new Date());
  const told = { robot, stamp, pose: { x, y, yaw } };
  await site.client().robots.report({ map: 'office', report: told });
}

test('robots are drawn where they are, and move', async ({ site, dashboard }) => {
  const [before, after] = [
    [5, 6],
    [6, 6],
  ] as const;
  await report(site, 'robot-1', ...before);
  await dashboard.open(site, { layers: ['floor'], view: [5.5, 6, 0.01] });
  const floor = await dashboard.colourAt([5.5, 5.5]);
  await expect.poll(() => dashboard.colourAt(before)).not.toBe(floor);
  await report(site, 'robot-1', ...after);
  await expect.poll(() => dashboard.colourAt(after)).not.toBe(floor);
  await expect.poll(() => dashboard.colourAt(before)).toBe(floor);
});

test('lines lead from robots to the flags of their goals', async ({
  exploredSite: site,
  dashboard,
  page,
}) => {
  await claimGoals(site);
  await report(site, 'robot-1', 1.8, 2.9, 0.5);
  await report(site, 'robot-2', 9.5, 2.9, 2);
  await report(site, 'robot-3', 10.6, 6.2, -1.5);
  await dashboard.open(site);
  await dashboard.panel('Explore');
  const panel = page.getByRole('region', { name: 'Explore' });
  const robots = panel.getByRole('region', { name: 'Robots' }).getByRole('listitem');
  await expect(robots).toHaveCount(3);
  await shot(page, 'robots');
});
