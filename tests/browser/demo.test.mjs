// The demo as a person meets it: a part is captured, appears, is coloured, and can be taken apart by component.

import assert from 'node:assert/strict';
import { after, before, it } from 'node:test';
import { VIEWPORT, newPage } from './support/chromium.mjs';
import { Ply } from './support/ply.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** The model must fill at least this share of the page, or it was not brought into view. */
const LEAST_DRAWN = 0.03;

onEveryBackend(
  'the demo',
  (session, backend) => {
    let viewer;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      await viewer.finished();
    }, LIMIT);
    after(() => viewer?.close());

    it('draws on the backend it was given', LIMIT, async () => {
      const state = await viewer.until((s) => Number(s.frames) > 0, null, 'the first frame');
      assert.equal(state.backend, backend);
      assert.match(state.hash, /^[0-9a-f]{16}$/);
    });

    it('hides what a device draws to be tested', LIMIT, async () => {
      const page = await newPage(session.browser);
      try {
        await page.addInitScript(() => {
          const seen = (window.selfTest = []);
          const look = () => {
            const canvas = document.getElementById('viewport');
            if (canvas?.dataset.selfTest) seen.push(`${canvas.dataset.selfTest} ${getComputedStyle(canvas).opacity}`);
          };
          new MutationObserver(look).observe(document, { subtree: true, attributes: true, attributeFilter: ['data-self-test'] });
        });
        await page.goto(session.agent.url);
        await page.waitForFunction(() => document.getElementById('viewport')?.dataset.selfTest === 'over', null, { timeout: 60_000 });
        const seen = await page.evaluate(() => [...new Set(window.selfTest)]);
        assert.deepEqual(seen.sort(), ['over 1', 'running 0']);
      } finally {
        await page.context().close();
      }
    });

    it('shows the part in colour', LIMIT, async () => {
      const picture = await viewer.picture();
      const { points } = await viewer.state();
      assert.ok(Number(points) > 1000, `${points} points at rest`);
      const page = VIEWPORT.width * VIEWPORT.height;
      assert.ok(picture.drawn() > LEAST_DRAWN * page, `${picture.drawn()} pixels of ${page} were drawn on`);
      assert.ok(picture.coloured() > 500, `${picture.coloured()} coloured pixels`);
    });

    it('shows something else in every colour mode', LIMIT, async () => {
      const pictures = new Map();
      for (const mode of ['appearance', 'component', 'confidence', 'views']) {
        await viewer.colorMode(mode);
        const picture = await viewer.picture();
        for (const [other, before] of pictures) {
          const change = picture.difference(before);
          assert.ok(change > 0.01, `${mode} looks like ${other}: ${(100 * change).toFixed(2)} % of the pixels differ`);
        }
        pictures.set(mode, picture);
      }
    });

    it('hides a component and brings it back', LIMIT, async () => {
      const { classes } = new Ply((await viewer.export('ply')).bytes);
      const colors = classes.map((one) => one.color);
      await viewer.colorMode('component');
      const all = (await viewer.picture()).byHue(colors);
      assert.ok(all.filter((count) => count > 50).length >= 3, `pixels by component: ${all}`);

      const largest = all.indexOf(Math.max(...all));
      await viewer.toggle(classes[largest].id);
      const without = (await viewer.picture()).byHue(colors);
      assert.ok(
        without[largest] < 0.05 * all[largest],
        `${classes[largest].name}: ${all[largest]} pixels, ${without[largest]} after it was hidden`,
      );
      const others = without.reduce((sum, count) => sum + count, 0) - without[largest];
      assert.ok(others > 50, 'the other components vanished too');

      await viewer.toggle(classes[largest].id);
      const again = (await viewer.picture()).byHue(colors);
      assert.ok(again[largest] > 0.95 * all[largest], `${again[largest]} of ${all[largest]} pixels came back`);
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: {} },
);
