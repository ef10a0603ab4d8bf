// The timeline: a kept inspection is shown as it stood after each view, from the agent and from a file without one.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, it } from 'node:test';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const data = mkdtempSync(join(tmpdir(), 'semascan-timeline-'));
after(() => rmSync(data, { recursive: true, force: true }));

onEveryBackend(
  'the timeline',
  (session) => {
    let viewer, page, final, file;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      final = await viewer.finished();
    }, LIMIT);
    after(() => viewer?.close());

    const timeline = (of = page) => of.getByTestId('timeline');
    const stops = async (of = page) => Number(await timeline(of).getAttribute('data-stops'));
    /** Shows a stop by the slider; the points that it has. */
    const slide = async (place, of = viewer) => {
      await of.page.getByTestId('timeline-slider').fill(String(place));
      await of.page.locator(`[data-testid=timeline][data-at="${place}"]`).waitFor();
      await of.page.locator(`[data-testid=progress][data-done="${place}"]`).waitFor({ timeout: 30_000 });
      return Number(await of.page.getByTestId('export-note').getAttribute('data-held'));
    };

    it('is made of what the agent keeps, and begins at the end', LIMIT, async () => {
      const views = Number(await page.getByTestId('progress').getAttribute('data-done'));
      await page.getByTestId('timeline-load').click();
      await page.locator('[data-testid=connection][data-state=recorded]').waitFor({ timeout: 60_000 });
      await viewer.until((s, hash) => s.hash === hash && s.phase === 'finished', final.hash, 'the model as it was');
      assert.equal(await stops(), views + 1);
      assert.match(await page.getByTestId('timeline-place').innerText(), /^After all \d+ views$/);
    });

    it('shows the model after every view, forwards and backwards', LIMIT, async () => {
      const last = (await stops()) - 1;
      const points = [];
      for (let place = 0; place <= last; place++) points.push(await slide(place));
      assert.equal(points[0], 0, 'before the first view there is nothing');
      assert.ok(points.every((n, i) => i === 0 || n > 0), String(points));
      assert.ok(points[1] < points[last], `${points}`);
      assert.equal((await viewer.state()).hash, final.hash);
      for (const place of [last - 1, 1, last, 2]) assert.equal(await slide(place), points[place], `view ${place} again`);
      await slide(0);
      assert.equal(await page.getByTestId('viewport-message').getAttribute('data-state'), 'before');
    });

    it('is drawn as it stood', LIMIT, async () => {
      await viewer.colorMode('component');
      const last = (await stops()) - 1;
      await slide(last);
      const whole = await viewer.picture();
      await slide(1);
      const first = await viewer.picture();
      assert.ok(first.drawn() > 1000 && first.difference(whole) > 0.005, `${first.difference(whole)} differs after one view`);
      await slide(last);
      assert.ok((await viewer.picture()).difference(whole) < 0.002, 'the end is what it was');
    });

    it('plays from view to view, and is steered by keys', LIMIT, async () => {
      const last = (await stops()) - 1;
      await slide(last);
      await page.getByTestId('timeline-play').click();
      await page.locator(`[data-testid=timeline][data-at="1"]`).waitFor({ timeout: 10_000 });
      assert.equal(await page.getByTestId('timeline-play').innerText(), 'Pause');
      await page.locator(`[data-testid=timeline][data-at="${last}"]`).waitFor({ timeout: 30_000 });
      await page.getByTestId('timeline-play').getByText('Play').waitFor();
      await viewer.until((s, hash) => s.hash === hash, final.hash, 'the end');
      await page.locator('#viewport').focus();
      await page.keyboard.press('[');
      await page.locator(`[data-testid=timeline][data-at="${last - 1}"]`).waitFor();
      await page.keyboard.press(']');
      await page.locator(`[data-testid=timeline][data-at="${last}"]`).waitFor();
    });

    it('makes the mesh of what is shown', LIMIT, async () => {
      const triangles = async () => {
        await page.locator('[data-testid=mesh][data-state=ready][data-outdated=false]').waitFor({ timeout: 120_000 });
        return Number(await page.getByTestId('mesh').getAttribute('data-triangles'));
      };
      await viewer.choose('show-mesh');
      const whole = await triangles();
      await slide(1);
      await page.locator(`[data-testid=mesh]:not([data-triangles="${whole}"])[data-state=ready]`).waitFor({ timeout: 120_000 });
      assert.ok((await triangles()) < whole);
      await viewer.choose('show-points');
    });

    it('leads back to the agent', LIMIT, async () => {
      await page.getByTestId('timeline-close').click();
      await page.locator('[data-testid=connection][data-state=connected]').waitFor({ timeout: 60_000 });
      await viewer.finished();
      await page.getByTestId('timeline-load').waitFor();
    });

    it('is saved as one file, which a page without an agent shows with findings and photographs', LIMIT, async () => {
      const begun = page.waitForEvent('download');
      await page.getByTestId('export-inspection-full').click();
      file = await readFile(await (await begun).path());
      const other = await Viewer.open(session.browser, `${session.agent.url}?model=nothing.ply`);
      try {
        const asked = [];
        other.page.on('request', (request) => request.url().includes('/api/') && asked.push(request.url()));
        const upload = { name: 'motor.semascan', mimeType: 'application/octet-stream', buffer: file };
        await other.page.getByTestId('open-file').setInputFiles(upload);
        await other.page.locator('[data-testid=connection][data-state=file]').waitFor();
        await other.until((s, hash) => s.hash === hash && s.phase === 'finished', final.hash, 'the same model');
        await other.page.getByTestId('review').waitFor({ timeout: 30_000 });
        const findings = async (of) => of.locator('[data-testid^=finding-]:not([data-testid=finding-detail])').allInnerTexts();
        await other.page.locator('[data-testid=finding-1]').waitFor();
        assert.deepEqual(await findings(other.page), await findings(page));
        assert.equal(await other.page.getByTestId('ruling-accept').count(), 0, 'nobody decides in a file');
        await other.page.locator('[data-testid=finding-1]').click();
        await other.page.getByTestId('evidence-open').click();
        await other.page.locator('[data-testid=evidence-picture][data-full=true]').waitFor({ timeout: 30_000 });
        const last = (await stops(other.page)) - 1;
        assert.ok((await slide(1, other)) > 0);
        await slide(last, other);
        await other.until((s, hash) => s.hash === hash, final.hash, 'the end');
        // Whose page it is the page asks when it starts.
        const of = asked.filter((url) => !url.endsWith('/api/v1/me'));
        assert.deepEqual(of, [], 'no agent is asked');
        await other.page.evaluate(await readFile(AXE, 'utf8'));
        const { violations } = await other.page.evaluate(() => globalThis.axe.run());
        const serious = violations.filter((v) => ['serious', 'critical'].includes(v.impact));
        assert.deepEqual(serious.map((v) => `${v.id}: ${v.nodes.map((n) => n.html).join()}`), []);
      } finally {
        await other.close();
      }
    });

    it('says what is wrong with a broken file, and keeps what is shown', LIMIT, async () => {
      const open = (name, buffer) => page.getByTestId('open-file').setInputFiles({ name, mimeType: 'application/octet-stream', buffer });
      const said = (text) => page.getByTestId('notice').getByText(text).waitFor({ timeout: 30_000 });
      await open('cut.semascan', file.subarray(0, file.length / 2));
      await said(/cut\.semascan: it is cut off after \d+ entries/);
      await open('ply.semascan', Buffer.from('ply\n'));
      await said(/ply\.semascan: it is no inspection of Semascan's/);
      assert.equal((await viewer.state()).connection, 'connected');
      viewer.assertNoErrors();
    });
  },
  { agent: { args: ['--data', join(data, 'cell')] } },
);
