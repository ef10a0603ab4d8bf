// The tour: offered to who is here for the first time, in five steps, and not again.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, it } from 'node:test';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

onEveryBackend(
  'the tour',
  (session) => {
    let viewer, page, tour;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      tour = page.getByTestId('tour');
      await viewer.finished();
    }, LIMIT);
    after(() => viewer?.close());

    const step = () => tour.getAttribute('data-step');
    const marked = () => page.locator('[data-toured]').count();

    it('leads through the page by the keyboard alone', LIMIT, async () => {
      assert.equal(await tour.count(), 0, 'it is offered, and does not begin by itself');
      await page.getByTestId('tour-begin').click();
      await tour.waitFor();
      await page.waitForFunction(() => document.activeElement?.dataset.testid === 'tour-next');
      const seen = [];
      for (;;) {
        seen.push(await step());
        assert.equal(await marked(), 1, `${seen.at(-1)} is about a place`);
        assert.ok((await tour.getByRole('heading').innerText()).length > 3);
        if (seen.length === 1) {
          await page.evaluate(await readFile(AXE, 'utf8'));
          const { violations } = await page.evaluate(() => globalThis.axe.run(document.querySelector('[data-testid=tour]')));
          assert.deepEqual(violations.map((v) => `${v.id}: ${v.help}`), []);
        }
        await page.keyboard.press('Enter');
        if ((await tour.count()) === 0) break;
      }
      assert.deepEqual(seen, ['look', 'colors', 'pick', 'review', 'more']);
      assert.equal(await marked(), 0);
    });

    it('is not offered again, but found by its name', LIMIT, async () => {
      await page.reload();
      await viewer.finished();
      assert.equal(await page.getByTestId('tour-offer').count(), 0);
      await page.keyboard.press('Control+k');
      await page.getByTestId('palette-field').fill('tour');
      await page.keyboard.press('Enter');
      await tour.waitFor();
      assert.equal(await step(), 'look');
      await page.getByTestId('tour-next').click();
      await page.getByTestId('tour-back').click();
      assert.equal(await step(), 'look');
      await page.getByTestId('tour-next').focus();
      await page.keyboard.press('Escape');
      await tour.waitFor({ state: 'detached' });
      viewer.assertNoErrors();
    });
  },
  { agent: {}, backends: ['webgl2'] },
);
