// What the journeys of scans without depth share.
import { copyFileSync, mkdirSync, readdirSync } from 'node:fs';
import { join } from 'node:path';

/** A copy of a scan in the layout of 7-Scenes at `folder`, its depth images left out. */
export function withoutDepth(scan, folder) {
  mkdirSync(folder);
  for (const file of readdirSync(scan).filter((file) => !file.endsWith('.depth.png'))) copyFileSync(join(scan, file), join(folder, file));
  return folder;
}

/** Downloads the mesh as PLY, to a file of this name. */
export async function save(visitor, path) {
  copyFileSync(await (await visitor.download('[data-format=ply]')).path(), path);
  return path;
}

/** Chooses options of the page's menus by their labels, one after the other, and waits for the plan with each. */
export async function choose({ page }, options) {
  const planned = () => page.evaluate(() => window.record.events.filter(({ type }) => type === 'planned').length);
  for (const [label, option] of Object.entries(options)) {
    const before = await planned();
    await page.getByLabel(label).selectOption(option);
    await page.waitForFunction((before) => window.record.events.filter(({ type }) => type === 'planned').length > before, before);
  }
}

/** The stages so far. */
export const stages = async (visitor) => (await visitor.events('stage')).map(({ stage }) => stage);

/** Progress within a stage. */
export async function progressOf(visitor, stage) {
  const events = await visitor.page.evaluate(() => window.record.events.filter(({ type }) => type === 'stage' || type === 'progress'));
  let current;
  return events.filter((event) => {
    if (event.type === 'stage') current = event.stage;
    return event.type === 'progress' && current === stage;
  });
}
