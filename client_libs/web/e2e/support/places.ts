import { fileURLToPath } from 'node:url';

/** The folder of the checkout, with a slash at its end. */
export const root = fileURLToPath(new URL('../../../../', import.meta.url));

/** The folder of the programs, the dashboard and the results of the tests. */
export const buildFolder = process.env.HYPERMAP_BUILD ?? `${root}build`;

/** The folder of recorded maps, which need not exist. */
export const dataFolder = process.env.HYPERMAP_DATA ?? `${root}../shared/data`;

/** The folder of the built dashboard. */
export const dashboardFolder = process.env.HYPERMAP_DASHBOARD ?? `${buildFolder}/dashboard`;

/** The system's browser. Playwright's own browsers are not available from a package registry. */
export const chromium = process.env.HYPERMAP_CHROMIUM ?? '/usr/bin/chromium-headless-shell';

/** The path of a program of the build. */
export const program = (name: string): string => `${buildFolder}/bin/${name}`;
