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
  await site.hypermap('map', 'delete', 'office', '--yes');
  await expect(page.getByRole('alert')).toContainText('office');

  await site.hypermap('map', 'create', 'office');
  await site.hypermap('layer', 'create', 'office', 'things', '--kind', 'semantic');
  await putSquare(site, 'things', 'barrel', [7.25, 5.75]);
  await dashboard.isLive();
  await expect(page.getByText(/^revision 2$/)).toBeVisible();
  await expect(page.getByText(/^As of/)).toBeHidden();
  expect(new URL(page.url()).searchParams.has('at')).toBe(false);
});

test.describe('a server that knows identities', () => {
  // The browser logs the wrong token.
  test.use({ expectedErrors: [/status of 401/] });

  test('the page signs in with a token, offers what the role may do, and signs out', async ({
    site,
    page,
  }) => {
    const token = await site.requireIdentity('anna', 'reader');
    await page.goto(site.url);
    const form = page.getByRole('form', { name: 'Sign in' });
    await expect(form).toBeVisible();
    await shot(page, 'token');
    await form.getByLabel('Token').fill(`${token}x`);
    await form.getByRole('button', { name: 'Sign in' }).click();
    await expect(form.getByRole('alert')).toHaveText('the token is not known, or has expired');
    await form.getByLabel('Token').fill(token);
    await form.getByRole('button', { name: 'Sign in' }).click();
    await expect(page.getByRole('status', { name: 'Connection' })).toHaveText('Live');
    await expect(form).toBeHidden();

    const anna = page.getByRole('group', { name: 'Signed in' });
    await expect(anna).toContainText('anna, reader');
    const panels = page.getByRole('navigation', { name: 'Panels' });
    await expect(panels.getByRole('button', { name: 'Explore' })).toBeVisible();
    await expect(panels.getByRole('button', { name: 'Edit' })).toBeHidden();
    await panels.getByRole('button', { name: 'Export' }).click();
    await expect(page.getByRole('radio', { name: 'Hypermap (.hmap)' })).toBeChecked();
    await expect(page.getByRole('radio', { name: 'GeoPackage' })).toBeHidden();
    await shot(page, 'reader');

    // Scripts can't read the cookie, and a page that is loaded again is still signed in.
    expect(await page.evaluate(() => document.cookie)).toBe('');
    await page.reload();
    await expect(anna).toBeVisible();
    await anna.getByRole('button', { name: 'Sign out' }).click();
    await expect(form).toBeVisible();
    await expect(anna).toBeHidden();
  });
});
