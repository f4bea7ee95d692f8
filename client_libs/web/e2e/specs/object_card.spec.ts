import { expect, shot, test } from '../support/test.js';

test('a card shows the evidence that robots have for an object', async ({
  exploredSite,
  dashboard,
  page,
}) => {
  const parts = exploredSite
    .client()
    .query.queryValue({ scope: { map: 'office', layers: ['found'] }, value: 'chair' });
  const chairs = [];
  for await (const { part } of parts) chairs.push(...(part?.objects ?? []));
  const { x = NaN, y = NaN } = chairs[0]?.centroid ?? {};
  await dashboard.open(exploredSite, { layers: ['floor', 'found'], view: [x, y, 0.01] });
  await dashboard.click([x, y]);

  const card = page.getByRole('article', { name: 'Object chair' });
  await expect(card.getByText('Existence', { exact: true })).toBeVisible();
  await expect(card.getByRole('region', { name: 'Classes' })).toContainText(/chair\s*[<>\d ]+%/);
  const evidence = card.getByRole('region', { name: 'Evidence' });
  await expect(evidence.getByRole('img', { name: /Existence over time/ })).toBeVisible();
  await expect(evidence).toContainText(/Last seen by robot-\d/);
  await shot(page, 'object_card');
  await evidence.getByText(/^Seen \d+ times/).click();
  const events = evidence.getByRole('list', { name: 'Observations' }).getByRole('listitem');
  await expect(events.last()).toContainText(/founded|seen/);
});

test('an object that was added by hand has no evidence', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [12.2, 2.9, 0.02] });
  await dashboard.click([12.2, 0.5]);
  const card = page.getByRole('article', { name: 'Object oven' });
  await expect(card).toContainText('added by hand');
  await expect(card).toContainText('Last change');
  await expect(card).toContainText('0.36 m²');
});
