// The page at the sizes that it is used at: nothing is cut off, and everything that is clicked is large enough to be hit
// (WCAG 2.2, success criterion 2.5.8: 24 by 24 pixels).

import assert from 'node:assert/strict';
import { mkdir } from 'node:fs/promises';
import { after, before, describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { launch, newPage } from './support/chromium.mjs';
import { misfits } from './support/layout.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const SIZES = [
  { width: 320, height: 640 },
  { width: 640, height: 360 },
  { width: 1440, height: 900 },
  { width: 3840, height: 2160 },
];

const OUT = new URL('./out/', import.meta.url);

describe('the layout', () => {
  let agent, browser;
  before(async () => {
    agent = await Agent.start();
    browser = await launch('webgl2');
  }, LIMIT);
  after(async () => {
    await browser?.close();
    await agent?.stop();
  }, LIMIT);

  for (const size of SIZES) {
    const name = `${size.width}x${size.height}`;
    it(`fits ${name}, and every target can be hit`, LIMIT, async () => {
      const page = await newPage(browser, size);
      const viewer = new Viewer(page);
      await page.goto(agent.url);
      await viewer.finished();
      await viewer.colorMode('confidence');
      await mkdir(OUT, { recursive: true });
      await page.screenshot({ path: new URL(`layout-${name}.png`, OUT).pathname });
      if (size.width < 640) {
        const [picture, scale] = await page.evaluate(() =>
          ['#viewport', '[data-testid=color-scale]'].map((which) => document.querySelector(which).getBoundingClientRect().toJSON()),
        );
        assert.ok(scale.top >= picture.bottom - 1, `the scale lies over the picture: ${scale.top} < ${picture.bottom}`);
      }

      const found = await misfits(page);
      assert.deepEqual(found.small, [], 'targets that are too small');
      assert.deepEqual(found.wide, [], 'reaches beyond the page');
      assert.equal(found.scroll, 0, 'the page scrolls sideways');

      // The model has most of the page, and text on a large one is not too small to read.
      const { width } = await viewer.canvas.boundingBox();
      assert.ok(width >= 0.5 * size.width, `the model is ${width} wide`);
      if (size.width >= 3000) {
        const line = await page.evaluate(() => document.querySelector('.panel h2').getBoundingClientRect().height);
        assert.ok(line >= 24, `lines of ${line} px on a page of ${name}`);
      }
      await page.context().close();
    });
  }
});
