// Links to what one sees: whoever follows one sees the same inspection, from the same place, in the same colours.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, it } from 'node:test';
import { Picture } from './support/pixels.mjs';
import { Ply } from './support/ply.mjs';
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
      // Cut open, by a plane and a box.
      const cut = () => page.locator('[data-testid=section][data-state=cut]').waitFor({ timeout: 120_000 });
      await page.keyboard.press('s');
      await cut();
      await viewer.redrawn(() => page.keyboard.press('d'));
      await page.getByTestId('section-box').check();
      await page.getByTestId('section-x-to').fill('10');
      await viewer.redrawn(() => page.getByTestId('section-x-to').press('Enter'));
      await cut();
      const offset = await page.getByTestId('section-offset').inputValue();
      await viewer.canvas.focus();
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
        await follower.page.locator('[data-testid=section][data-state=cut]').waitFor({ timeout: 120_000 });
        const followed = await follower.page.getByTestId('section-offset').inputValue();
        assert.ok(Math.abs(followed - offset) < 0.011, `${followed} and ${offset}`);
        assert.equal((await follower.state()).inspection, inspection);
        assert.ok((await follower.picture()).difference(picture) < 0.01, 'the same picture');
        assert.deepEqual(follower.errors, []);
      } finally {
        await follower.close();
      }
    });

    it('are followed in a page that is open, and what is not understood is said', LIMIT, async () => {
      await page.getByTestId('section-reset').click();
      await viewer.redrawn(() => page.evaluate(() => (location.hash = '#eye=400,0,200&target=0,0,100&color=component&finding=seven')));
      await page.waitForFunction(() => document.querySelector('[data-testid=color-mode-component]').checked);
      await page.getByText("The link's finding is not understood").waitFor();
      const before = await viewer.picture();
      await viewer.redrawn(() => page.evaluate(() => (location.hash = '#eye=-400,0,200&target=0,0,100')));
      assert.ok((await viewer.picture()).difference(before) > 0.01, 'from the other side');
    });

    it('the picture is saved with what its colours mean', LIMIT, async () => {
      await viewer.colorMode('component');
      const shown = await viewer.picture();
      const started = page.waitForEvent('download', { timeout: 60_000 });
      await page.getByTestId('save-picture').click();
      const download = await started;
      assert.match(download.suggestedFilename(), /\.png$/);
      await page.getByText(/\.png saved/).waitFor();
      const saved = new Picture(await readFile(await download.path()));
      assert.equal(saved.width, shown.width);
      assert.ok(saved.height > shown.height + 40, 'a strip with a legend');
      const colors = new Ply((await viewer.export('ply')).bytes).classes.filter((c) => c.id > 0).map((c) => c.color);
      const [there, here] = [saved.byHue(colors), shown.byHue(colors)];
      assert.ok(here.reduce((a, b) => a + b) > 1000);
      there.forEach((pixels, i) => assert.ok(pixels > here[i] - 50 && pixels > 100, `${there} and ${here}`));
    });

    it('a picture at rest has several samples a pixel', LIMIT, async () => {
      await viewer.picture();
      assert.equal((await viewer.state()).samples, '2');
    });
  },
  { agent: {} },
);
