// Where a label would teach most: the list in the panel of corrections leads there, with the brush in hand, and says what is done.

import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, it } from 'node:test';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const SOURCE = 'virtual:starter-motor?seed=1003&views=2&size=320x240&errors=none';
const data = mkdtempSync(join(tmpdir(), 'semascan-teaching-'));
after(() => rmSync(data, { recursive: true, force: true }));

onEveryBackend(
  'where a label teaches most',
  (session) => {
    let viewer, page, said;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      await viewer.finished();
      await page.getByTestId('teach-open').waitFor({ timeout: 60_000 });
      said = await page.evaluate(async () => {
        const id = document.getElementById('viewport').dataset.inspection;
        return (await fetch(`/api/v1/inspections/${id}/teaching?limit=8`)).json();
      });
    }, LIMIT);
    after(() => viewer?.close());

    const rows = () => page.locator('[data-testid^=teach-][data-done]');

    it('is listed as the agent orders it', LIMIT, async () => {
      assert.ok(said.regions.length > 1 && said.nothing === undefined, JSON.stringify(said).slice(0, 300));
      assert.ok(said.regions.every((region, i) => i === 0 || said.regions[i - 1].worth >= region.worth));
      await page.getByTestId('teach-open').click();
      await page.getByTestId('teach-1').waitFor({ timeout: 30_000 });
      const texts = await rows().allInnerTexts();
      assert.equal(texts.length, said.regions.length);
      said.regions.forEach(({ name, sigma }, i) => assert.ok(texts[i].includes(name) && texts[i].includes(sigma.toFixed(2)), texts[i]));
    });

    it('leads there with the brush of its component, and is done by a mark', LIMIT, async () => {
      await viewer.redrawn(() => page.getByTestId('teach-1').click());
      assert.equal(await page.getByTestId('correct-brush').getAttribute('aria-pressed'), 'true');
      assert.equal(await page.getByTestId('correct-class').inputValue(), `component-${said.regions[0].component}`);
      assert.equal(await page.getByTestId('teach-1').getAttribute('data-done'), 'false');
      const box = await viewer.canvas.boundingBox();
      await viewer.redrawn(() => page.mouse.click(box.x + box.width / 2, box.y + box.height / 2));
      await page.locator('[data-testid=teach-1][data-done=true]').waitFor({ timeout: 30_000 });
      // What is taken back is not done.
      await page.getByTestId('correct-undo').click();
      await page.locator('[data-testid=teach-1][data-done=false]').waitFor();
    });

    it('log no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: { source: SOURCE, models: 'two-stream-edge', args: ['--data', data] }, backends: ['webgl2'] },
);
