// Corrections: a brush gives the surface another class, in the picture at once and in the log once it is signed; an outline becomes
// a finding. Others see both.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, it } from 'node:test';
import { Ply } from './support/ply.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

onEveryBackend(
  'corrections',
  (session) => {
    let viewer, page, panel, classes, place, unpainted;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      panel = page.getByTestId('correct');
      await viewer.finished();
      await panel.waitFor({ timeout: 30_000 });
      await viewer.colorMode('component');
      classes = new Ply((await viewer.export('ply')).bytes).classes.filter((c) => c.id > 0);
      const picture = await viewer.picture();
      unpainted = share(picture);
      // A place well within a component, and another class that it shall have.
      const largest = unpainted.indexOf(Math.max(...unpainted));
      const places = picture.insides(colors(), 14).filter(({ color, y }) => color === largest && y > 90);
      place = places[Math.floor(places.length / 2)];
      place.other = (largest + 1) % classes.length;
    }, LIMIT);
    after(() => viewer?.close());

    const colors = () => classes.map((c) => c.color);
    /** Pixels of each class. */
    const share = (picture) => picture.byHue(colors());
    const ask = (path, of = page) =>
      of.evaluate(async (path) => {
        const id = document.getElementById('viewport').dataset.inspection;
        return (await fetch(`/api/v1/inspections/${id}/${path}`)).json();
      }, path);
    const marks = (count) => page.waitForFunction((n) => document.querySelector('[data-testid=correct]')?.dataset.marks === n, String(count), { timeout: 20_000 });
    const arrived = () => page.waitForFunction(() => document.querySelector('[data-testid=review]')?.dataset.unsent === '0', null, { timeout: 30_000 });
    /** Drags over the view, along places relative to the chosen one. */
    const drag = async (steps) => {
      const box = await viewer.canvas.boundingBox();
      const at = ([x, y]) => [box.x + place.x + x, box.y + place.y + y];
      await page.mouse.move(...at(steps[0]));
      await page.mouse.down();
      for (const step of steps.slice(1)) {
        await page.mouse.move(...at(step), { steps: 4 });
        // Places are picked a few a picture, which the processor draws: no faster than that.
        await page.waitForTimeout(400);
      }
      await page.mouse.up();
    };
    const sign = async (reason) => {
      await page.getByTestId('correct-reason').fill(reason);
      const person = page.getByTestId('correct-person');
      if ((await person.inputValue()) === '') await person.fill('B. Corrector');
      await page.getByTestId('correct-sign').click();
      await marks(0);
      await arrived();
    };

    it('paint another class where the brush goes, and take it back', LIMIT, async () => {
      await viewer.canvas.focus();
      await page.keyboard.press('q');
      assert.equal(await page.getByTestId('correct-brush').getAttribute('aria-pressed'), 'true');
      await page.getByTestId('correct-class').selectOption(`component-${classes[place.other].id}`);
      await page.keyboard.press(']');
      assert.equal(await page.getByTestId('correct-width').innerText(), '10 mm');
      await viewer.redrawn(() => drag([[-12, 0], [0, 0], [12, 0]]));
      await marks(1);
      const painted = share(await viewer.picture());
      assert.ok(painted[place.other] > unpainted[place.other] + 150, `${unpainted} -> ${painted}`);
      await viewer.redrawn(() => page.keyboard.press('z'));
      await marks(0);
      const undone = share(await viewer.picture());
      assert.ok(Math.abs(undone[place.other] - unpainted[place.other]) < 20, `${unpainted} -> ${undone}`);
      await viewer.redrawn(() => page.keyboard.press('Shift+Z'));
      await marks(1);
    });

    it('stand in the log once they are signed, and others see them', LIMIT, async () => {
      await sign('it is the other one');
      const { items } = await ask('reviews?limit=500');
      const relabel = items.findLast((item) => item.review.action.type === 'relabel');
      assert.equal(relabel.review.action.component, classes[place.other].name);
      assert.equal(relabel.review.reason, 'it is the other one');
      assert.ok(relabel.review.action.patch.points.length > 2);
      const other = await Viewer.open(session.browser, session.agent.url);
      try {
        await other.finished();
        await other.colorMode('component');
        await other.page.waitForFunction(() => Number(document.querySelector('[data-testid=correct]')?.dataset.earlier) > 0, null, { timeout: 30_000 });
        const seen = share(await other.picture());
        assert.ok(seen[place.other] > unpainted[place.other] + 150, `${unpainted} -> ${seen}`);
        await other.redrawn(() => other.page.getByTestId('correct-earlier').uncheck());
        const hidden = share(await other.picture());
        assert.ok(hidden[place.other] < seen[place.other] - 150, `${seen} -> ${hidden}`);
        assert.deepEqual(other.errors, []);
      } finally {
        await other.close();
      }
    });

    it('draw around what was not found, and it is a finding with figures', LIMIT, async () => {
      const found = (await ask('findings')).now.length;
      await viewer.canvas.focus();
      await page.keyboard.press('Shift+Q');
      assert.equal(await page.getByTestId('correct-outline').getAttribute('aria-pressed'), 'true');
      const name = await page.getByTestId('correct-class').locator('option').nth(1).innerText();
      await page.getByTestId('correct-class').selectOption({ label: name });
      await drag([[-10, -10], [10, -10], [10, 10], [-10, 10], [-10, -8]]);
      await marks(1);
      // By its corners, too.
      const box = await viewer.canvas.boundingBox();
      for (const [x, y] of [[-6, -6], [6, -6], [0, 6]]) {
        await page.mouse.click(box.x + place.x + x, box.y + place.y + y);
        await page.waitForTimeout(400);
      }
      await page.getByTestId('correct-close').click();
      await marks(2);
      await sign('nobody saw it');
      await page.waitForFunction((n) => document.querySelectorAll('[data-testid=review] .finding').length >= Math.min(n, 5), found + 2, { timeout: 30_000 });
      const { now } = await ask('findings');
      assert.equal(now.length, found + 2);
      const drawn = now.filter((finding) => (finding.kind.kind ?? finding.kind) === 'drawn').slice(-2);
      assert.equal(drawn.length, 2);
      for (const finding of drawn) {
        assert.ok(finding.region?.area.value > 1e-6, JSON.stringify(finding).slice(0, 400));
      }
      await page.keyboard.press('Escape');
    });

    it('give what is seen in a loop another class, and a whole segment', LIMIT, async () => {
      await page.getByTestId('correct-lasso').click();
      await page.getByTestId('correct-class').selectOption(`component-${classes[place.other].id}`);
      await viewer.colorMode('component');
      const before = share(await viewer.picture());
      const own = unpainted.indexOf(Math.max(...unpainted));
      await viewer.redrawn(() => drag([[-14, 16], [14, 16], [14, 40], [-14, 40]]));
      await marks(1);
      const looped = share(await viewer.picture());
      assert.ok(looped[place.other] > before[place.other] + 150, `${before} -> ${looped}`);
      assert.equal(await page.getByTestId('correct-loop').count(), 0, 'the loop is gone');
      await page.getByTestId('correct-segment').click();
      const box = await viewer.canvas.boundingBox();
      await viewer.redrawn(() => page.mouse.click(box.x + place.x, box.y + place.y));
      await marks(2);
      const filled = share(await viewer.picture());
      assert.ok(filled[own] < 0.3 * before[own], `${before} -> ${filled}`);
      await viewer.redrawn(() => page.keyboard.press('z'));
      await viewer.redrawn(() => page.keyboard.press('z'));
      await marks(0);
      assert.ok(Math.abs(share(await viewer.picture())[own] - before[own]) < 60);
      await page.keyboard.press('Escape');
    });

    it('turn the view by the right button while one draws', LIMIT, async () => {
      await viewer.canvas.focus();
      await page.keyboard.press('q');
      const box = await viewer.canvas.boundingBox();
      await viewer.redrawn(async () => {
        await page.mouse.move(box.x + place.x, box.y + place.y);
        await page.mouse.down({ button: 'right' });
        await page.mouse.move(box.x + place.x + 90, box.y + place.y, { steps: 3 });
        await page.mouse.up({ button: 'right' });
      });
      await marks(0);
      await page.keyboard.press('Escape');
      assert.equal(await page.getByTestId('correct-brush').getAttribute('aria-pressed'), 'false');
    });

    it('can be used by everybody', LIMIT, async () => {
      await page.getByTestId('correct-brush').click();
      await page.evaluate(await readFile(AXE, 'utf8'));
      const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
      assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.map((n) => n.target).join('; ')}`), []);
      assert.deepEqual(viewer.errors, []);
    });
  },
  { agent: { source: 'virtual:starter-motor?seed=7&views=6&size=480x360' } },
);
