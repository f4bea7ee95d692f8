import { fileURLToPath } from 'node:url';

/** The checkout. */
export const root = fileURLToPath(new URL('../../../../', import.meta.url));

/** Where the programs, the dashboard and what the tests leave behind lie. */
export const buildFolder = process.env.HYPERMAP_BUILD ?? `${root}build`;

/** The dashboard, built. */
export const dashboardFolder = process.env.HYPERMAP_DASHBOARD ?? `${buildFolder}/dashboard`;

/** Debian's browser: Playwright's own can't be had from a package registry. */
export const chromium = process.env.HYPERMAP_CHROMIUM ?? '/usr/bin/chromium';

export const program = (name: string): string => `${buildFolder}/bin/${name}`;
