// Elements fitted where a person clicks, and what is measured between them: the figures agree with each other and with the
// points that were clicked.

import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { readFile } from 'node:fs/promises';
import { after, before, it } from 'node:test';
import { Ply } from './support/ply.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

/** Pixels around a place that is clicked which are all of one component. */
const MARGIN = 8;

onEveryBackend(
  'measuring elements',
  (session) => {
    let viewer, page, places, cylinder;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      await viewer.finished();
      await viewer.colorMode('component');
      const colors = new Ply((await viewer.export('ply')).bytes).classes.filter((c) => c.id > 0).map((c) => c.color);
      // Under the bar of the overlay nothing can be clicked.
      places = (await viewer.picture()).insides(colors, MARGIN).filter(({ y }) => y > 60);
      assert.ok(places.length >= 30, `${places.length} places`);
    }, LIMIT);
    after(() => viewer?.close());

    const button = (name) => page.getByTestId('measure').getByRole('button', { name, exact: true });
    const prompt = () => page.getByTestId('measure-prompt');

    const clickAt = async ({ x, y }) => {
      const box = await viewer.canvas.boundingBox();
      await page.mouse.click(box.x + x, box.y + y);
    };

    /** Clicks at places until the list has one entry more; its number and data, and the place. */
    const fitted = async (name) => {
      const entries = page.locator('[data-testid^=measurement-]');
      const count = await entries.count();
      for (const place of places) {
        // Chosen anew, so that what is said is of this place.
        await button(name).click();
        await prompt().getByText('Pick a place').waitFor();
        await clickAt(place);
        await page.waitForFunction(
          (count) =>
            document.querySelectorAll('[data-testid^=measurement-]').length > count ||
            /^No /.test(document.querySelector('[data-testid=measure-prompt]').textContent),
          count,
          { timeout: 30_000 },
        );
        if ((await entries.count()) > count) {
          const entry = entries.last();
          const data = await entry.evaluate((element) => ({ ...element.dataset }));
          return { place, entry, data, number: Number(data.testid.split('-')[1]) };
        }
        await button(name).click();
      }
      throw new Error(`no ${name} at ${places.length} places: ${await prompt().innerText()}`);
    };

    it('has a mesh made and fits a cylinder where one clicks', LIMIT, async () => {
      await button('Cylinder').click();
      await page.locator('[data-testid=mesh][data-state=ready]').waitFor({ timeout: 120_000 });
      await prompt().getByText('Pick a place on a cylinder').waitFor();
      await button('Cylinder').click();
      const before = await viewer.picture();
      cylinder = await fitted('Cylinder');
      const { entry, data } = cylinder;
      assert.ok(data.mm > 2 && data.mm < 120, `a radius of ${data.mm} mm`);
      assert.ok(data.uncertainty > 0.01 && data.uncertainty < 0.35 * data.mm, `U ${data.uncertainty} mm of ${data.mm}`);
      assert.ok(Number(data.points) >= 12);
      assert.match(await entry.innerText(), /R\s[\d.]+ ± [\d.]+\smm/);
      assert.match(await entry.innerText(), /\d+ points, \d+ left out; residual/);
      assert.ok((await viewer.picture()).difference(before) > 0.0005, 'its wireframe is drawn');
    });

    it('measures from its axis to the place that was clicked: a radius away', LIMIT, async () => {
      const { place, data, number } = cylinder;
      await button('Distance').click();
      await page.getByRole('button', { name: `Pick cylinder ${number}` }).click();
      await prompt().getByText('second point').waitFor();
      await clickAt(place);
      const entry = page.getByTestId(`measurement-${number + 1}`);
      await entry.getByText(`cylinder ${number} – point`).waitFor({ timeout: 20_000 });
      const away = Number(await entry.getAttribute('data-mm'));
      assert.ok(Math.abs(away - data.mm) < 3, `${away} mm from the axis of a cylinder of ${data.mm} mm`);
    });

    it('keeps the unit for the next visit', LIMIT, async () => {
      await viewer.choose('measure-unit-inch');
      assert.match(await page.getByTestId('measurement-1').innerText(), /inch/);
      await page.reload();
      await viewer.finished();
      // Before there is a picture a click is at nothing.
      await viewer.picture();
      assert.equal(await page.getByTestId('measure-unit-inch').isChecked(), true);
      await viewer.choose('measure-unit-mm');
    });

    it('measures along the surface, never less than straight', LIMIT, async () => {
      const [a, b] = [places[0], places.at(-1)];
      await button('Distance').click();
      await clickAt(a);
      await prompt().getByText('second point').waitFor({ timeout: 20_000 });
      await clickAt(b);
      await page.getByTestId('measurement-1').waitFor({ timeout: 20_000 });
      const straight = Number(await page.getByTestId('measurement-1').getAttribute('data-mm'));
      await button('Along surface').click();
      await page.locator('[data-testid=mesh][data-state=ready]').waitFor({ timeout: 120_000 });
      await clickAt(a);
      await prompt().getByText('second point').waitFor({ timeout: 20_000 });
      await clickAt(b);
      const said = page.getByTestId('measurement-2').or(prompt().getByText('No way leads there'));
      await said.first().waitFor({ timeout: 30_000 });
      if (await page.getByTestId('measurement-2').count()) {
        const along = Number(await page.getByTestId('measurement-2').getAttribute('data-mm'));
        assert.ok(along > straight - 1.5, `${along} mm along the surface, ${straight} mm straight`);
      }
    });

    it('measures an area, and has no violation of accessibility (WCAG 2.2 AA)', LIMIT, async () => {
      const { data } = await fitted('Area');
      assert.ok(data.mm2 > 1 && data.uncertainty > 0, JSON.stringify(data));
      await page.evaluate(await readFile(AXE, 'utf8'));
      const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
      assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.map((n) => n.target).join('; ')}`), []);
    });

    it('keeps measurements with the inspection, for everybody, until they are withdrawn', LIMIT, async () => {
      const ask = (path) =>
        page.evaluate(async (path) => {
          const id = document.getElementById('viewport').dataset.inspection;
          return (await fetch(`/api/v1/inspections/${id}/${path}`)).json();
        }, path);
      const arrived = () =>
        page.waitForFunction(() => document.querySelector('[data-testid=review]')?.dataset.unsent === '0', null, { timeout: 30_000 });
      // The agent serves both backends: what the first one kept is there already.
      const listed = await page.locator('[data-testid^=measurement-]').count();
      const all = (await ask('measurements')).items.length + listed;
      await page.getByTestId('measure-keep-reason').fill('first piece');
      const person = page.getByTestId('measure-keep-person');
      if ((await person.inputValue()) === '') await person.fill('C. Metrologist');
      await page.getByTestId('measure-keep-sign').click();
      await arrived();
      await page.getByTestId(`kept-${all}`).waitFor({ timeout: 30_000 });
      const { items } = await ask('measurements');
      assert.equal(items.length, all);
      assert.ok(items.every((kept) => kept.note === 'first piece' && kept.measurement.features.length > 0));
      const area = items.find((kept) => kept.measurement.kind === 'area').measurement;
      assert.ok(area.figure.value > 1e-6 && area.figure.expanded > 0 && area.lines.length > 3, JSON.stringify(area.figure));
      assert.equal(await page.locator('[data-testid^=measurement-][data-kept=true]').count(), listed);
      // Somebody else sees figures and lines.
      const other = await Viewer.open(session.browser, session.agent.url);
      try {
        await other.finished();
        const entry = other.page.getByTestId('kept-1');
        await entry.waitFor({ timeout: 30_000 });
        assert.match(await entry.innerText(), /±[\s\S]*first piece/);
        const label = other.page.locator('[data-testid^=kept-label-]');
        assert.equal(await label.count(), all);
        const shown = await other.picture();
        await other.redrawn(() => other.page.getByTestId('measure-kept').uncheck());
        assert.ok((await other.picture()).difference(shown) > 0.0003, 'their lines are hidden');
        assert.equal(await label.count(), 0);
        other.assertNoErrors();
      } finally {
        await other.close();
      }
      await page.getByRole('button', { name: 'Withdraw kept measurement 1' }).click();
      await page.getByTestId('measure-withdraw-reason').fill('beside the edge');
      await page.keyboard.press('Enter');
      await arrived();
      await page.getByTestId(`kept-${all}`).waitFor({ state: 'detached', timeout: 30_000 });
      assert.equal((await ask('measurements')).items.length, all - 1);
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: {} },
);
