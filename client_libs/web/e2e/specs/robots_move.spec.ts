import type { Locator, Page } from '@playwright/test';

import type { Dashboard, Place } from '../support/dashboard.js';
import type { Colour, Picture, Pixel } from '../support/picture.js';
import { knownRobots, SimulatedRobots, type KnownRobot } from '../support/robots.js';
import type { Site } from '../support/site.js';
import { expect, shot, test } from '../support/test.js';

/** The part of the office that the robots explore, beside the panels. */
const VIEW = [8.78, 5.6, 0.022] as const;
/** The colour of arrows of robots that are online, and of flags and the ways to them. */
const BLUE: Colour = [37, 96, 201];
const GREY: Colour = [123, 135, 148];
/** Robots are told apart, and ways to goals are seen, from this distance on, metres. */
const APART_M = 1;

const distance = ([ax, ay]: Place, [bx, by]: Place): number => Math.hypot(ax - bx, ay - by);

/** Whether there are three robots, apart from each other. */
function areApart(robots: readonly KnownRobot[]): boolean {
  const isAlone = ({ position }: KnownRobot, i: number) =>
    robots.slice(i + 1).every((other) => distance(position, other.position) > APART_M);
  return robots.length === 3 && robots.every(isAlone);
}

/** Whether a robot has a goal that is not near. */
function isOnItsWay({ position, goal }: KnownRobot): boolean {
  return goal !== undefined && distance(position, goal) > APART_M;
}

/** The pixel at a distance from the centre of a robot along its heading. */
function alongHeading(dashboard: Dashboard, { position, yaw }: KnownRobot, pixels: number): Pixel {
  const { x, y } = dashboard.at(position);
  return { x: x + pixels * Math.cos(yaw), y: y - pixels * Math.sin(yaw) };
}

/** Whether an arrow of a colour is where a robot is, and points where the robot looks. */
function hasArrow(dashboard: Dashboard, picture: Picture, robot: KnownRobot, colour: Colour) {
  const at = (pixels: number) => picture.has(colour, alongHeading(dashboard, robot, pixels));
  // An arrow has its notch behind its centre.
  return at(0) && at(5) && !at(-8);
}

/** Waits until the page has an arrow for each robot as the server knows it. */
async function expectArrows(site: Site, dashboard: Dashboard): Promise<void> {
  const shown = async () => {
    const robots = await knownRobots(site);
    const picture = await dashboard.picture();
    return robots.map((robot) => hasArrow(dashboard, picture, robot, BLUE));
  };
  await expect.poll(shown).toEqual([true, true, true]);
}

/** The share of the pixels on the way from a robot to its goal that are blue, without its ends. */
function blueShare(dashboard: Dashboard, picture: Picture, from: Place, to: Place): number {
  const [start, end] = [dashboard.at(from), dashboard.at(to)];
  const steps = Math.floor(Math.hypot(end.x - start.x, end.y - start.y));
  const pixels = Array.from({ length: steps }, (_, i) => ({
    x: start.x + ((end.x - start.x) * i) / steps,
    y: start.y + ((end.y - start.y) * i) / steps,
  })).slice(18, -8);
  // A thin line that leans has mixed colours.
  return pixels.filter((pixel) => picture.has(BLUE, pixel, 50)).length / pixels.length;
}

/** Waits until each robot's goal has a flag, to which a dashed line leads from the robot. */
async function expectGoals(
  dashboard: Dashboard,
  robots: readonly KnownRobot[],
  before: Picture,
): Promise<void> {
  const shown = async () => {
    const picture = await dashboard.picture();
    return robots.map(({ position, goal = position }) => {
      const share = (of: Picture) => blueShare(dashboard, of, position, goal);
      const hasLine = share(picture) > share(before) + 0.3;
      return picture.has(BLUE, dashboard.at(goal)) && hasLine;
    });
  };
  await expect.poll(shown).toEqual([true, true, true]);
}

const listed = (page: Page): Locator =>
  page
    .getByRole('region', { name: 'Explore' })
    .getByRole('region', { name: 'Robots' })
    .getByRole('listitem');

test('simulated robots are shown where the server says, and move', async ({
  site,
  dashboard,
  page,
}) => {
  // The robots stay online while they are stopped to be looked at.
  await site.killServer();
  await site.restartServer('--robot_online_seconds=600');
  await dashboard.open(site, { view: VIEW });
  const simulated = new SimulatedRobots(site);
  try {
    const first = await simulated.driveUntil(
      (robots) => areApart(robots) && robots.every(isOnItsWay),
    );
    await expectArrows(site, dashboard);
    const withoutGoals = await dashboard.picture();
    await dashboard.panel('Explore');
    await expect(listed(page)).toHaveText(first.map(({ name }) => new RegExp(`^${name}reveals `)));
    await expectGoals(dashboard, first, withoutGoals);
    await shot(page, 'robots-1');

    await page.getByRole('button', { name: 'Close Explore' }).click();
    const hasMoved = ({ position }: KnownRobot) =>
      first.every((old) => distance(position, old.position) > APART_M);
    await simulated.driveUntil((robots) => areApart(robots) && robots.every(hasMoved));
    await expectArrows(site, dashboard);
    const later = await dashboard.picture();
    const left = first.map((robot) => hasArrow(dashboard, later, robot, BLUE));
    expect(left).toEqual([false, false, false]);
    await dashboard.panel('Explore');
    await expect(listed(page)).toHaveCount(3);
    await shot(page, 'robots-2');
  } finally {
    await simulated.kill();
  }
});

test('robots whose reports stop are offline', async ({ site, dashboard, page }) => {
  await site.killServer();
  await site.restartServer('--robot_online_seconds=3');
  await dashboard.open(site, { view: VIEW });
  await dashboard.panel('Explore');
  const simulated = new SimulatedRobots(site);
  try {
    await expect(listed(page)).toHaveCount(3);
    await expect(listed(page).filter({ hasText: 'offline' })).toHaveCount(0);
    await simulated.driveUntil(areApart);
  } finally {
    await simulated.kill();
  }
  const words = /^robot-\doffline, last seen \d+ s ago$/;
  await expect(listed(page)).toHaveText([words, words, words]);
  const robots = await knownRobots(site);
  expect(robots.map(({ online }) => online)).toEqual([false, false, false]);
  const shown = async () => {
    const picture = await dashboard.picture();
    return robots.map(({ position }) => picture.has(GREY, dashboard.at(position)));
  };
  await expect.poll(shown).toEqual([true, true, true]);
  await shot(page, 'robots-offline');
});
