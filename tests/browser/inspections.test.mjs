// The list of inspections that an agent keeps: looked for, opened as they were, with their reports.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, it } from 'node:test';
import { Agent, BINARY, SOURCE } from './support/agent.mjs';
import { launch, newPage } from './support/chromium.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const CRITERIA = 'version = 1\nname = "motor"\nrevision = "3"\n[[defect]]\ndefect = "corrosion"\nlargest_area_mm2 = 1\nthen = "rework"\n';
const OTHER = SOURCE.replace('seed=7', 'seed=8');
const OUT = new URL('./out/', import.meta.url);
const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

describe('the list of inspections', () => {
  let root, data, agent, browser, page;
  const errors = [];

  before(async () => {
    root = mkdtempSync(join(tmpdir(), 'semascan-inspections-'));
    data = join(root, 'cell');
    const criteria = join(root, 'criteria.toml');
    writeFileSync(criteria, CRITERIA);
    for (const source of [SOURCE, OTHER]) {
      const done = spawnSync(BINARY, ['inspect', source, '--data', data, '--criteria', criteria], { encoding: 'utf8' });
      assert.equal(done.status, 0, done.stderr);
    }
    // A third one, which nobody judges, is live.
    agent = await Agent.start({ args: ['--data', data] });
    browser = await launch('webgl2');
    page = await newPage(browser, { width: 1280, height: 800 });
    page.on('pageerror', (error) => errors.push(String(error)));
    page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  }, LIMIT);

  after(async () => {
    await browser?.close();
    await agent?.stop();
    rmSync(root, { recursive: true, force: true });
  }, LIMIT);

  const listed = async (count) => {
    await page.waitForFunction((n) => document.querySelectorAll('#rows tr').length === n, count, { timeout: 30_000 });
    return page.locator('#rows tr').evaluateAll((rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent)));
  };

  it('is found from the viewer and shows what is kept, the latest first', LIMIT, async () => {
    const viewer = new Viewer(page);
    await page.goto(agent.url);
    await viewer.finished();
    await page.getByRole('link', { name: 'Inspections' }).click();
    const rows = await listed(3);
    assert.deepEqual(
      rows.map((cells) => cells[0]),
      ['starter motor 7', 'starter motor 8', 'starter motor 7'],
    );
    assert.ok(rows.slice(1).every((cells) => /rework|a person decides/.test(cells[6])), JSON.stringify(rows));
    assert.equal(rows[0][6], 'not judged');
    assert.ok(!(await page.locator('#more').isVisible()), 'there are no earlier ones');
    mkdirSync(OUT, { recursive: true });
    await page.screenshot({ path: new URL('inspections.png', OUT).pathname, caret: 'initial', animations: 'allow' });
  });

  it('says how this cell is', LIMIT, async () => {
    await page.locator('#cell-state', { hasText: 'finished' }).waitFor({ timeout: 30_000 });
    assert.match(await page.locator('#cell-said').textContent(), /\d+ of \d+ views/);
    assert.equal(await page.locator('#cell-watch').getAttribute('href'), './');
    assert.equal(await page.locator('#cell-views').isVisible(), false, 'nothing is under way');
  });

  it('shows what the inspections come to, day by day and by what was found', LIMIT, async () => {
    await page.locator('#trends summary').click();
    await page.locator('#trends-said', { hasText: '3 inspections' }).waitFor({ timeout: 30_000 });
    const kinds = await page.locator('#days rect').evaluateAll((bars) => bars.map((bar) => bar.dataset.kind));
    assert.ok(kinds.includes('none') && kinds.some((kind) => kind === 'rework' || kind === 'person'), `${kinds}`);
    assert.match(await page.locator('#days svg').getAttribute('aria-label'), /^\d{4}-\d\d-\d\d: .*1 not judged/);
    // How sure the labels were: one point, because all were today or, at midnight, two.
    const sure = page.locator('#confidence svg');
    assert.match(await sure.getAttribute('aria-label'), /^\d{4}-\d\d-\d\d: \d+(\.\d)? %/);
    assert.equal(await sure.locator('circle').count(), await page.locator('#days g').count());
    const found = await page.locator('#classes tr').evaluateAll((rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent.trim())));
    assert.ok(found.some(([what, , count, area]) => /^corrosion on /.test(what) && Number(count) > 0 && /mm²$/.test(area)), JSON.stringify(found));
    await page.evaluate(await readFile(AXE, 'utf8'));
    const violations = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
    assert.deepEqual(violations.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.map((n) => n.target).join('; ')}`), []);
    // They are of what is searched for.
    await page.getByLabel('Part').fill('starter motor 8');
    await page.getByRole('button', { name: 'Search' }).click();
    await page.locator('#trends-said', { hasText: '1 inspection' }).waitFor({ timeout: 30_000 });
    await page.getByRole('button', { name: 'Clear' }).click();
    await listed(3);
    await page.locator('#trends summary').click();
  });

  it('is searched, and the address keeps what was searched for', LIMIT, async () => {
    await page.getByLabel('Part').fill('starter motor 8');
    await page.getByRole('button', { name: 'Search' }).click();
    assert.equal((await listed(1))[0][0], 'starter motor 8');
    assert.equal(new URL(page.url()).search, '?part=starter+motor+8');
    await page.reload();
    await listed(1);
    assert.equal(await page.getByLabel('Part').inputValue(), 'starter motor 8');
    await page.goBack();
    await listed(3);
    await page.getByLabel('State').selectOption('failed');
    await page.getByLabel('Began on or after').fill('2020-01-01');
    await page.getByRole('button', { name: 'Search' }).click();
    await page.getByText('No inspection fits.').waitFor();
    await page.getByRole('button', { name: 'Clear' }).click();
    await listed(3);
  });

  it('says what the agent refuses', LIMIT, async () => {
    await page.goto(`${agent.url}/inspections.html?part=${'x'.repeat(400)}`);
    await page.waitForFunction(() => !['', 'Loading …'].includes(document.getElementById('said').textContent));
    assert.equal((await listed(0)).length, 0);
  });

  it('can be used by everybody, also on a narrow page', LIMIT, async () => {
    for (const size of [{ width: 1280, height: 800 }, { width: 320, height: 640 }]) {
      await page.setViewportSize(size);
      await page.goto(`${agent.url}/inspections.html`);
      await listed(3);
      await page.evaluate(await readFile(AXE, 'utf8'));
      const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
      assert.deepEqual(found.violations.map((violation) => `${violation.id}: ${violation.help}`), []);
      // The table scrolls, the page does not.
      const wide = await page.evaluate(() => {
        const list = document.getElementById('list');
        const outside = [...document.querySelectorAll('body *')].filter((e) => !list.contains(e) && e.getBoundingClientRect().right > innerWidth);
        return [document.documentElement.scrollWidth - innerWidth, ...outside.map((e) => e.outerHTML.slice(0, 80))];
      });
      assert.deepEqual(wide, [0]);
    }
    await page.setViewportSize({ width: 1280, height: 800 });
  });

  it('leads to the report, which is shown with its styles, and to the inspection as it was', LIMIT, async () => {
    await page.goto(`${agent.url}/inspections.html?part=starter+motor+8`);
    await listed(1);
    await page.getByRole('link', { name: 'Report' }).click();
    await page.getByRole('heading', { name: 'starter motor 8' }).waitFor();
    assert.match(await page.locator('#reviews').textContent(), /Nobody has reviewed this inspection/);
    const kicker = await page.locator('h1').evaluate((heading) => getComputedStyle(heading).fontSize);
    assert.notEqual(kicker, '32px', 'a style of its own and not that of the browser');
    await page.goBack();
    await listed(1);
    const viewer = new Viewer(page);
    await page.getByRole('link', { name: 'starter motor 8' }).click();
    await viewer.until((s) => s.connection === 'connected' && Number(s.points) > 1000, null, 'its model', 120_000);
    assert.match(page.url(), /\?inspection=/);
  });

  it('logs no error', () => {
    // What the agent refused on purpose is one to the browser.
    assert.deepEqual(errors.filter((error) => !error.includes('400')), []);
  });
});
