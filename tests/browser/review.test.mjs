// Findings and decisions: by keyboard alone, seen by everybody who looks, and never lost on the way to the agent.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, it } from 'node:test';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

onEveryBackend(
  'review',
  (session) => {
    let viewer, page, panel;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      panel = page.getByTestId('review');
      await viewer.finished();
      await page.getByTestId('finding-1').waitFor({ timeout: 30_000 });
    }, LIMIT);
    after(() => viewer?.close());

    /** What the agent says, asked by the page itself. */
    const ask = (path, of = page) =>
      of.evaluate(async (path) => {
        const id = document.getElementById('viewport').dataset.inspection;
        return (await fetch(`/api/v1/inspections/${id}/${path}`)).json();
      }, path);

    /** Types into what has the focus, and signs by Enter. */
    const sign = async (reason, name) => {
      await page.getByTestId('draft-form').waitFor();
      await page.keyboard.type(reason);
      if (name && (await page.getByTestId('draft-person').inputValue()) === '') {
        await page.keyboard.press('Tab');
        await page.keyboard.type(name);
      }
      await page.keyboard.press('Enter');
      await page.getByTestId('draft-form').waitFor({ state: 'detached' });
    };

    const kind = (finding) => finding.kind.kind ?? finding.kind;

    /** Waits until nothing waits for the agent. */
    const arrived = () => page.waitForFunction(() => document.querySelector('[data-testid=review]')?.dataset.unsent === '0', null, { timeout: 20_000 });

    it('lists what the agent measured, and shows each finding where it is', LIMIT, async () => {
      const { now } = await ask('findings');
      const all = page.getByTestId('findings-all');
      assert.equal(await all.isVisible(), now.length > 5, 'a long list is cut');
      if (now.length > 5) {
        assert.equal(await panel.locator('.finding').count(), 5);
        await all.click();
      }
      assert.equal(await panel.locator('.finding').count(), now.length);
      for (const [i, finding] of now.slice(0, 3).entries()) {
        const text = await page.getByTestId(`finding-${i + 1}`).innerText();
        assert.ok(text.includes(finding.component.name), `${text}: ${finding.component.name}`);
        if (finding.region) assert.match(text, new RegExp(`\\b${(finding.region.area.value * 1e6).toFixed(0).slice(0, 1)}`));
      }
      const placed = now.findIndex((finding) => finding.region && Math.hypot(...finding.region.normal) > 0.5);
      assert.ok(placed >= 0, 'a finding with a place');
      await viewer.redrawn(() => page.getByTestId(`finding-${placed + 1}`).click());
      // Its place is picked: the card names its component, near the place that the agent says.
      const card = page.getByTestId('inspect-card');
      await card.waitFor();
      const mm = await card.evaluate((c) => ['xMm', 'yMm', 'zMm'].map((k) => Number(c.dataset[k])));
      const position = now[placed].region.position.map((c) => c * 1e3);
      assert.ok(Math.hypot(...mm.map((c, k) => c - position[k])) < 6, `${mm} and ${position}`);
      assert.ok((await page.getByTestId('finding-detail').innerText()).includes('mm²'));
      // The photographs that show it have its outline, around the pixel of its place.
      await page.getByTestId('evidence-open').click();
      const outline = page.getByTestId('evidence-outline').locator('path').last();
      await outline.waitFor({ state: 'attached', timeout: 20_000 });
      const path = (await outline.getAttribute('d')).split(/[ML]/).slice(1).map((pair) => pair.split(' ').map(Number));
      assert.ok(path.length > 4, `${path.length} corners`);
      const middle = [0, 1].map((k) => (Math.min(...path.map((p) => p[k])) + Math.max(...path.map((p) => p[k]))) / 2);
      const pixel = await page.getByTestId('evidence-picture').evaluate((p) => [Number(p.dataset.u), Number(p.dataset.v)]);
      assert.ok(Math.hypot(middle[0] - pixel[0], middle[1] - pixel[1]) < 40, `${middle} around ${pixel}`);
      await page.getByTestId('evidence-close').click();
      // And it is in the middle of the view.
      const ring = await page.locator('[data-testid=picked-ring][data-behind=false]').boundingBox();
      const box = await viewer.canvas.boundingBox();
      assert.ok(Math.abs(ring.x - box.x - box.width / 2) < 40 && Math.abs(ring.y - box.y - box.height / 2) < 40, JSON.stringify(ring));
      await page.keyboard.press('Escape');
    });

    it('takes a whole review by keyboard', LIMIT, async () => {
      await viewer.canvas.focus();
      const { now } = await ask('findings');
      const keys = { y: 'accept', r: 'rework', x: 'reject' };
      let at = -1;
      for (;;) {
        await page.keyboard.press('k');
        if ((await page.getByTestId('finding-1').getAttribute('aria-pressed')) === 'true') break;
      }
      for (const [key, action] of Object.entries(keys).slice(0, Math.min(3, now.length))) {
        at++;
        assert.equal(await page.getByTestId(`finding-${at + 1}`).getAttribute('aria-pressed'), 'true');
        await page.keyboard.press(key);
        await sign(`because of ${action}, "c" and all`, 'Kim Reviewer');
        await viewer.canvas.focus();
      }
      await arrived();
      const { items } = await ask('reviews');
      const mine = items.slice(-Object.keys(keys).length).map(({ review }) => [review.subject.finding, review.action.type, review.person]);
      assert.deepEqual(mine, now.slice(0, 3).map((finding, i) => [finding.id, Object.values(keys)[i], 'Kim Reviewer']));
      await page.waitForFunction(() => document.querySelector('[data-testid=finding-1] .decision')?.dataset.decision === 'accept');
      // The part as a whole, with none chosen.
      await page.keyboard.press('Escape');
      await page.keyboard.press('Escape');
      for (let i = 0; i < 4 && !/the part/.test(await page.getByTestId('ruling-title').innerText()); i++) await page.keyboard.press('Escape');
      await page.keyboard.press('r');
      await sign('can be worked on');
      await arrived();
      await page.waitForFunction(() => document.querySelector('[data-testid=verdict]')?.dataset.decision === 'rework');
      assert.equal((await ask('verdict')).decision, 'rework');
    });

    it('shows to others what somebody decides, and letters in a field are letters', LIMIT, async () => {
      const other = await Viewer.open(session.browser, session.agent.url);
      try {
        await other.finished();
        await other.page.getByTestId('finding-2').waitFor({ timeout: 30_000 });
        await page.getByTestId('finding-2').click();
        await page.getByTestId('ruling-reject').click();
        const mode = (await page.locator('[data-testid^=color-mode-]:checked').first().getAttribute('data-testid'));
        await sign('cat');
        assert.equal(await page.locator('[data-testid^=color-mode-]:checked').first().getAttribute('data-testid'), mode, 'c is no shortcut while one writes');
        await arrived();
        await other.page.waitForFunction(() => document.querySelector('[data-testid=finding-2] .decision')?.dataset.decision === 'reject', null, { timeout: 20_000 });
      } finally {
        await other.close();
      }
    });

    it('keeps a decision while the agent cannot be reached, through a reload, and sends it once', LIMIT, async () => {
      const before = (await ask('reviews?limit=500')).items.length;
      // The browser reaches nothing of the agent's interface.
      await page.route('**/api/v1/inspections/*/reviews', (route) => (route.request().method() === 'POST' ? route.abort() : route.continue()));
      await viewer.canvas.focus();
      await page.getByTestId('finding-3').click();
      await viewer.canvas.focus();
      await page.keyboard.press('i');
      await sign('kept while the line was down');
      await page.getByTestId('unsent').waitFor();
      await page.reload();
      await viewer.finished();
      await page.getByTestId('unsent').waitFor({ timeout: 30_000 });
      await page.unroute('**/api/v1/inspections/*/reviews');
      await arrived();
      const { items } = await ask('reviews?limit=500');
      assert.equal(items.length, before + 1);
      assert.equal(items.at(-1).review.reason, 'kept while the line was down');
    });

    it('calls a finding by another class, and one an error', LIMIT, async () => {
      const { now } = await ask('findings');
      const at = now.findIndex((finding) => kind(finding) === 'defect');
      const all = page.getByTestId('findings-all');
      if (at >= 5 && (await all.getAttribute('aria-expanded')) !== 'true') await all.click();
      const row = page.getByTestId(`finding-${at + 1}`);
      if ((await row.getAttribute('aria-pressed')) !== 'true') await row.click();
      const choice = page.getByTestId('finding-class');
      const is = await choice.inputValue();
      const names = await choice.locator('option').evaluateAll((options) => options.map((o) => o.value));
      const other = names.find((name) => name && name !== is);
      await choice.selectOption(other);
      await sign('seen on the part itself');
      await arrived();
      await page.waitForFunction(([id, name]) => document.querySelector(`[data-testid=${id}]`)?.innerText.includes(name), [`finding-${at + 1}`, other], { timeout: 20_000 });
      await row.click();
      await page.getByTestId('finding-class').selectOption('');
      await sign('a shadow');
      await arrived();
      const { items } = await ask('reviews?limit=500');
      assert.deepEqual(items.slice(-2).map(({ review }) => [review.action.type, review.action.defect ?? null]), [['reclassify', other], ['reclassify', null]]);
      assert.equal((await ask('findings')).now.length, now.length - 1, 'what was found in error is none');
    });

    it('has no fault that a checker of accessibility finds', LIMIT, async () => {
      await page.getByTestId('finding-1').click();
      await page.getByTestId('ruling-accept').click();
      await page.getByTestId('draft-form').waitFor();
      await page.evaluate(await readFile(AXE, 'utf8'));
      const { violations } = await page.evaluate(() => globalThis.axe.run({ include: [['[data-testid=review]']] }, { runOnly: ['wcag2a', 'wcag2aa'] }));
      assert.deepEqual(violations.map((v) => `${v.id}: ${v.nodes.map((n) => n.target).join(' ')}`), []);
      await page.keyboard.press('Escape');
      viewer.assertNoErrors([/ERR_FAILED/]);
    });
  },
  { agent: {} },
);
