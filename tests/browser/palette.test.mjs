// The command palette: by keyboard alone, from opening it to what it does.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, it } from 'node:test';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

onEveryBackend(
  'the command palette',
  (session) => {
    let viewer, page;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      await viewer.finished();
    }, LIMIT);
    after(() => viewer?.close());

    const entries = () => page.getByTestId('palette-entry');
    const field = () => page.getByTestId('palette-field');

    it('does what is found by its words, by the keyboard', LIMIT, async () => {
      await page.keyboard.press('Control+k');
      await field().waitFor();
      const all = await entries().count();
      assert.ok(all > 30, `${all} commands`);
      await page.keyboard.type('colours conf');
      assert.deepEqual(await entries().locator('.palette-label').allInnerTexts(), ['Confidence']);
      await viewer.redrawn(() => page.keyboard.press('Enter'));
      assert.equal(await field().count(), 0, 'it is closed');
      assert.equal(await page.getByTestId('color-mode-confidence').isChecked(), true);
    });

    it('goes through what it finds by the arrows, and closes by Escape', LIMIT, async () => {
      await page.getByTestId('palette-open').click();
      await page.keyboard.type('look from');
      const count = await entries().count();
      assert.equal(count, 7);
      const chosen = () => page.locator('[data-testid=palette-entry][aria-selected=true]').innerText();
      const first = await chosen();
      await page.keyboard.press('ArrowUp');
      assert.notEqual(await chosen(), first);
      assert.equal(await field().getAttribute('aria-activedescendant'), `palette-${count - 1}`);
      await page.keyboard.press('ArrowDown');
      assert.equal(await chosen(), first);
      await page.evaluate(await readFile(AXE, 'utf8'));
      const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
      assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.map((n) => n.target).join('; ')}`), []);
      await page.keyboard.press('Escape');
      await field().waitFor({ state: 'detached' });
      // The letters that were written did nothing else.
      assert.equal(await page.getByTestId('help').evaluate((dialog) => dialog.open), false);
    });

    it('says that nothing is found, and a click does it as well', LIMIT, async () => {
      await page.keyboard.press('Control+k');
      await page.keyboard.type('nothing like it');
      await page.getByText('No command has these words.').waitFor();
      await field().fill('cylinder');
      await entries().first().click();
      assert.equal(await page.getByTestId('measure').getAttribute('data-kind'), 'cylinder');
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: {} },
);
