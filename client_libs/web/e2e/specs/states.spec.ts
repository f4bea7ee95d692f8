import { putSquare } from '../support/edits.js';
import { expect, shot, test } from '../support/test.js';

test('the page says that the server has no map, and shows the first one that is created', async ({
  emptySite,
  page,
}) => {
  await page.goto(emptySite.url);
  await expect(page.getByText('There is no map on this server yet.')).toBeVisible();
  await shot(page, 'empty');
  await emptySite.hypermap('map', 'create', 'yard');
  await expect(page.getByText('This map has no layers yet.')).toBeVisible();
  await emptySite.hypermap('layer', 'create', 'yard', 'things', '--kind', 'semantic');
  await expect(page.getByText('The layers of this map are empty.')).toBeVisible();
});

test('a missing map is an error until it exists, and another one can be chosen', async ({
  site,
  page,
}) => {
  await page.goto(`${site.url}/?map=attic`);
  await expect(page.getByRole('alert')).toContainText('attic');
  await expect(page.getByRole('status', { name: 'Connection' })).toHaveText('Error');
  await shot(page, 'error');
  await page.getByRole('button', { name: 'Try again' }).click();
  await expect(page.getByRole('alert')).toContainText('attic');
  await site.hypermap('map', 'create', 'attic');
  await expect(page.getByText('This map has no layers yet.')).toBeVisible();
  await page.getByRole('combobox', { name: 'Map', exact: true }).selectOption('office');
  await expect(page.getByRole('status', { name: 'Connection' })).toHaveText('Live');
  await expect(page.getByRole('alert')).toBeHidden();
});

test('C5 an open page reports that its map was deleted, and shows the one made again', async ({
  site,
  dashboard,
  page,
}) => {
  const view = [7, 6, 0.01] as const;
  const { revision } = await site.client().catalog.listLayers({ map: 'office' });
  await dashboard.open(site, { view, at: revision - 1n });
  await expect(page.getByText(/^As of/)).toBeVisible();
  await site.hypermap('map', 'delete', 'office');
  await expect(page.getByRole('alert')).toContainText('office');

  await site.hypermap('map', 'create', 'office');
  await site.hypermap('layer', 'create', 'office', 'things', '--kind', 'semantic');
  await putSquare(site, 'things', 'barrel', [7.25, 5.75]);
  await dashboard.isLive();
  await expect(page.getByText(/^revision 2$/)).toBeVisible();
  await expect(page.getByText(/^As of/)).toBeHidden();
  expect(new URL(page.url()).searchParams.has('at')).toBe(false);
});

test('the page asks for a token if the server requires one', async ({ site, page }) => {
  // Replaces the gateway by one that checks tokens.
  await page.route('**/hypermap.v1.*/**', async (route) => {
    if (route.request().headers()['authorization'] === 'Bearer open sesame') {
      await route.continue();
      return;
    }
    const headers = {
      'content-type': 'application/grpc-web+proto',
      'grpc-status': '16',
      'grpc-message': 'a token is needed',
    };
    await route.fulfill({ status: 200, headers, body: '' });
  });
  await page.goto(site.url);
  await expect(page.getByText('a token is needed')).toBeVisible();
  await shot(page, 'token');
  await page.getByLabel('Token').fill('open sesame');
  await page.getByRole('button', { name: 'Sign in' }).click();
  await expect(page.getByRole('status', { name: 'Connection' })).toHaveText('Live');
  await expect(page.getByText('a token is needed')).toBeHidden();
});
