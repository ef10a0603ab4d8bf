// Links to what one sees: whoever follows one sees the same inspection, from the same place, in the same colours.

import assert from 'node:assert/strict';
import { after, before, it } from 'node:test';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

onEveryBackend(
  'links',
  (session) => {
    let viewer, page;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      await viewer.finished();
      await page.getByTestId('finding-1').waitFor({ timeout: 30_000 });
    }, LIMIT);
    after(() => viewer?.close());

    it('lead to inspection, camera, colours and finding', LIMIT, async () => {
      await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
      await viewer.colorMode('defect');
      await viewer.redrawn(() => page.getByTestId('finding-2').click());
      // Arrows belong to the button otherwise.
      await viewer.canvas.focus();
      await viewer.redrawn(() => page.keyboard.press('ArrowLeft'));
      await viewer.redrawn(() => page.keyboard.press('+'));
      await page.keyboard.press('h');
      await page.getByText('Copied to the clipboard').waitFor();
      const address = await page.evaluate(() => navigator.clipboard.readText());
      const { inspection } = await viewer.state();
      assert.equal(new URL(address).searchParams.get('inspection'), inspection);
      // Without the ring of the focus.
      await page.evaluate(() => document.activeElement.blur());
      const picture = await viewer.picture();

      const follower = await Viewer.open(session.browser, address);
      try {
        await follower.finished();
        await follower.page.waitForFunction(
          () => document.querySelector('[data-testid=finding-2]')?.getAttribute('aria-pressed') === 'true',
          null,
          { timeout: 30_000 },
        );
        assert.ok(await follower.page.getByTestId('color-mode-defect').isChecked());
        assert.equal((await follower.state()).inspection, inspection);
        assert.ok((await follower.picture()).difference(picture) < 0.01, 'the same picture');
        assert.deepEqual(follower.errors, []);
      } finally {
        await follower.close();
      }
    });

    it('are followed in a page that is open, and what is not understood is said', LIMIT, async () => {
      await viewer.redrawn(() => page.evaluate(() => (location.hash = '#eye=400,0,200&target=0,0,100&color=component&finding=seven')));
      await page.waitForFunction(() => document.querySelector('[data-testid=color-mode-component]').checked);
      await page.getByText("The link's finding is not understood").waitFor();
      const before = await viewer.picture();
      await viewer.redrawn(() => page.evaluate(() => (location.hash = '#eye=-400,0,200&target=0,0,100')));
      assert.ok((await viewer.picture()).difference(before) > 0.01, 'from the other side');
    });

    it('a picture at rest has several samples a pixel', LIMIT, async () => {
      await viewer.picture();
      assert.equal((await viewer.state()).samples, '2');
    });
  },
  { agent: {} },
);
