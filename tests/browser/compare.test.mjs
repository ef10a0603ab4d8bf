// Two kept inspections from the same place: side by side, swiped, as a difference.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, it } from 'node:test';
import { BINARY, SOURCE } from './support/agent.mjs';
import { newPage } from './support/chromium.mjs';
import { Picture } from './support/pixels.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const OTHER = SOURCE.replace('seed=7', 'seed=8');
const root = mkdtempSync(join(tmpdir(), 'semascan-compare-'));
const data = join(root, 'cell');
after(() => rmSync(root, { recursive: true, force: true }));
const done = spawnSync(BINARY, ['inspect', OTHER, '--data', data], { encoding: 'utf8' });
assert.equal(done.status, 0, done.stderr);

onEveryBackend(
  'comparing two inspections',
  (session, backend) => {
    let page, ids;
    before(async () => {
      // Two panes and a line between them.
      page = await newPage(session.browser, { width: 1281, height: 720 });
      await page.goto(`${session.agent.url}/inspections.html`);
      // The one that is live has to be over before it can be compared.
      const list = async () => (await (await fetch(`${session.agent.url}/api/v1/inspections`)).json()).items;
      const areOver = (items) => items.length === 2 && items.every((item) => item.ended);
      let items = await list();
      for (let tries = 0; tries < 240 && !areOver(items); tries++) {
        await page.waitForTimeout(500);
        items = await list();
      }
      assert.ok(areOver(items), JSON.stringify(items));
      ids = items.map((item) => item.id);
    }, LIMIT);
    after(() => page?.context().close());

    const pane = (place) => page.frameLocator(`#pane-${place}`);
    const whole = async (place) => {
      await pane(place).locator('#viewport[data-phase=finished]').waitFor({ timeout: 120_000 });
      await page.waitForTimeout(500);
    };
    const picture = async (place) => {
      const canvas = pane(place).locator('#viewport');
      for (let attempt = 0, last = ''; attempt < 60; attempt++) {
        const frames = await canvas.getAttribute('data-frames');
        if (frames === last) break;
        last = frames;
        await page.waitForTimeout(500);
      }
      return new Picture(await canvas.screenshot({ animations: 'allow' }));
    };
    const open = async (first, second, mode = 'beside') => {
      await page.goto(`${session.agent.url}/compare.html?first=${first}&second=${second}&mode=${mode}&renderer=${backend}`);
    };

    it('begins in the list, with two that are chosen', LIMIT, async () => {
      await page.goto(`${session.agent.url}/inspections.html`);
      const boxes = page.getByRole('checkbox', { name: /^Compare / });
      await boxes.first().check();
      await page.getByText('choose another one').waitFor();
      await boxes.nth(1).check();
      await page.getByRole('link', { name: 'Compare the two' }).click();
      await page.waitForURL(/compare\.html/);
      const parameters = new URL(page.url()).searchParams;
      assert.deepEqual([parameters.get('first'), parameters.get('second')], ids);
      await page.locator('#name-0', { hasText: 'starter motor 7' }).waitFor();
      await page.locator('#name-1', { hasText: 'starter motor 8' }).waitFor();
      await whole(0);
      await whole(1);
      for (const place of [0, 1]) assert.ok((await picture(place)).drawn() > 3000, `pane ${place}`);
      assert.equal(await pane(0).locator('#panels').isVisible(), false, 'a pane has room for the model alone');
    });

    it('is looked at from the same place, whichever pane is steered', LIMIT, async () => {
      // The same inspection twice: from the same place it looks the same.
      await open(ids[0], ids[0]);
      await whole(0);
      await whole(1);
      const before = await picture(0);
      for (const [steered, key] of [[0, '2'], [1, '6']]) {
        await pane(steered).locator('#viewport').focus();
        await page.keyboard.press(key);
        await page.waitForTimeout(1000);
        const [one, other] = [await picture(0), await picture(1)];
        assert.ok(one.difference(before) > 0.02, `${key} moves the camera`);
        // Places are told in tenths of a millimetre.
        assert.ok(one.difference(other) < 0.03, `${key}: ${one.difference(other)} differs`);
      }
      await pane(0).getByTestId('color-mode-confidence').check({ force: true });
      await pane(1).locator('[data-testid=color-mode-confidence]:checked').waitFor({ state: 'attached', timeout: 30_000 });
    });

    it('is swiped with a slider and by its edge', LIMIT, async () => {
      await page.getByRole('radio', { name: 'Swipe' }).check({ force: true });
      const clip = () => page.locator('.compare-pane').nth(1).evaluate((pane) => getComputedStyle(pane).clipPath);
      assert.match(await clip(), /50%/);
      await page.locator('#edge').fill('25');
      assert.match(await clip(), /25%/);
      const { x, y, width, height } = await page.locator('main').boundingBox();
      await page.mouse.move(x + 0.25 * width, y + height / 2);
      await page.mouse.down();
      await page.mouse.move(x + 0.75 * width, y + height / 2, { steps: 4 });
      await page.mouse.up();
      assert.match(await clip(), /7[456](\.\d+)?%/);
      assert.match(page.url(), /mode=swipe/);
    });

    it('shows the difference as distances from the mesh of the other', LIMIT, async () => {
      await page.getByRole('radio', { name: 'Difference' }).check({ force: true });
      const difference = page.frameLocator('.compare-difference iframe');
      await difference.locator('[data-testid=deviation][data-mean-mm]').waitFor({ timeout: 180_000 });
      const figures = await difference.getByTestId('deviation').evaluate((f) => [f.dataset.meanMm, f.dataset.p95Mm].map(Number));
      assert.ok(Math.abs(figures[0]) < 0.1 && figures[1] < 0.5, `it is itself: ${figures} mm`);
    });

    it('can be used by everybody, and says what is wrong with its address', LIMIT, async () => {
      await open(ids[0], 'nothing');
      await page.getByText('The address does not say which two inspections').waitFor();
      await open(ids[0], ids[0].replace(/^..../, 'ffff'));
      await page.getByText(/there is no inspection/).waitFor();
      await page.evaluate(await readFile(AXE, 'utf8'));
      const { violations } = await page.evaluate(() => globalThis.axe.run(document, { iframes: false, runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
      assert.deepEqual(violations.map((v) => `${v.id}: ${v.nodes.map((n) => n.html).join()}`), []);
    });
  },
  { agent: { args: ['--data', data] } },
);
