import { claimGoals } from '../support/robots.js';
import { expect, shot, test } from '../support/test.js';

test('progress, frontiers and robots are shown and kept up to date', async ({
  exploredSite: site,
  dashboard,
  page,
}) => {
  await dashboard.open(site);
  await dashboard.panel('Explore');
  const panel = page.getByRole('region', { name: 'Explore' });
  await expect(panel.getByText('Under way')).toBeVisible();
  await expect(panel.getByText('No robot has a goal now.')).toBeVisible();
  const told = JSON.parse(await site.hypermap('--json', 'explore', 'status', 'office')) as {
    progress: { fraction: number };
  };
  const { fraction } = told.progress;
  expect(fraction).toBeGreaterThan(0.2);
  expect(fraction).toBeLessThan(0.95);
  await expect(panel.getByRole('progressbar')).toHaveJSProperty('value', fraction);
  await expect(panel.getByText(`${Math.round(100 * fraction)} %`)).toBeVisible();
  await expect(
    panel.getByRole('region', { name: 'Frontiers' }).getByRole('listitem'),
  ).not.toHaveCount(0);

  await claimGoals(site);
  const robots = panel.getByRole('region', { name: 'Robots' }).getByRole('listitem');
  await expect(robots).toHaveCount(3);
  await expect(robots.first()).toContainText('robot-1');
  await shot(page, 'exploration');

  await site.client().exploration.stopExploration({ map: 'office' });
  await expect(panel.getByText('Stopped')).toBeVisible();
  await expect(robots).toHaveCount(0);
});

test('goals and frontiers are on the map while the panel is open', async ({
  exploredSite: site,
  dashboard,
  page,
}) => {
  await claimGoals(site);
  const { exploration } = await site.client().exploration.getExploration({ map: 'office' });
  const goal = exploration?.goals[0]?.position;
  expect(goal).toBeDefined();
  if (!goal) return;
  await dashboard.open(site, { layers: ['floor'], view: [goal.x, goal.y, 0.01] });
  const floor = await dashboard.colourAt([goal.x, goal.y]);
  await dashboard.panel('Explore');
  await expect.poll(() => dashboard.colourAt([goal.x, goal.y])).not.toBe(floor);
  await page.getByRole('button', { name: 'Close Explore' }).click();
  await expect.poll(() => dashboard.colourAt([goal.x, goal.y])).toBe(floor);
});

test('the panel says that a map has no exploration', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  await dashboard.panel('Explore');
  await expect(page.getByText('This map has no exploration.')).toBeVisible();
});
