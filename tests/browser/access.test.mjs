// The viewer without a mouse, and as assistive technology sees it.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { launch } from './support/chromium.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

describe('access', () => {
  let agent, browser, viewer;

  before(async () => {
    agent = await Agent.start();
    browser = await launch('webgl2');
    viewer = await Viewer.open(browser, agent.url);
    await viewer.finished();
  }, LIMIT);
  after(async () => {
    await browser?.close();
    await agent?.stop();
  }, LIMIT);

  it('? opens the help and Escape closes it', LIMIT, async () => {
    const { page } = viewer;
    const help = page.getByRole('dialog');
    assert.equal(await help.count(), 0);
    await page.keyboard.press('?');
    await help.waitFor({ state: 'visible', timeout: 5000 });
    assert.match(await help.innerText(), /orbit/i);
    await page.keyboard.press('Escape');
    await help.waitFor({ state: 'hidden', timeout: 5000 });
  });

  it('the help is a button, too', LIMIT, async () => {
    await viewer.page.getByTestId('help-open').click();
    await viewer.page.getByRole('dialog').waitFor({ state: 'visible', timeout: 5000 });
    await viewer.page.keyboard.press('Escape');
  });

  it('arrow keys turn the model', LIMIT, async () => {
    const before = await viewer.picture();
    await viewer.canvas.focus();
    for (let i = 0; i < 5; i++) await viewer.page.keyboard.press('ArrowLeft');
    const turned = await viewer.picture();
    assert.ok(turned.difference(before) > 0.01, 'the picture did not change');
  });

  it('every control can be reached by Tab', LIMIT, async () => {
    const { page } = viewer;
    await page.evaluate(() => document.activeElement?.blur());
    const reached = new Set();
    for (let i = 0; i < 80; i++) {
      await page.keyboard.press('Tab');
      const id = await page.evaluate(() => document.activeElement?.dataset?.testid ?? document.activeElement?.id ?? '');
      if (id) reached.add(id);
    }
    for (const id of ['viewport', 'export-ply', 'export-glb', 'help-open']) {
      assert.ok(reached.has(id), `${id} is not among ${[...reached].join(', ')}`);
    }
  });

  for (const scheme of ['dark', 'light']) {
    it(`axe finds no violation in the ${scheme} theme`, LIMIT, async () => {
      await viewer.page.emulateMedia({ colorScheme: scheme });
      // A focused skip link lies over the brand, and that is no lack of contrast.
      await viewer.page.evaluate(() => document.activeElement?.blur());
      // The theme is there two frames after the system has changed it; axe would measure a mixture before.
      await viewer.page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
      const source = await readFile(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
      await viewer.page.evaluate(source);
      const { violations } = await viewer.page.evaluate(() => window.axe.run());
      const found = violations.map((v) => `${v.id} (${v.impact}): ${v.nodes.map((n) => `${n.target.join(' ')}: ${n.failureSummary}`).join(', ')}`);
      assert.deepEqual(found, []);
    });
  }

  it('logs no error', LIMIT, () => viewer.assertNoErrors());
});
