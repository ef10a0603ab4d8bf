// Picking, labels and measuring, by pixels: what the card says of a place is what the picture shows there, and the figures
// are those of the points that the page exports.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, it } from 'node:test';
import { Ply } from './support/ply.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

/** Pixels around a place that is clicked which are all of one component. */
const MARGIN = 5;

/** Farthest that a place on the mesh may be from the nearest point, millimetres: about a voxel and a half of these tests. */
const VOXELS = 3;

const distance = (a, b) => Math.hypot(...a.map((c, k) => c - b[k]));

/** What the tests do with the page, as a person does it. */
class Picker {
  constructor(viewer) {
    this.viewer = viewer;
    this.page = viewer.page;
    this.card = viewer.page.getByTestId('inspect-card');
  }

  async clickAt(x, y) {
    const box = await this.viewer.canvas.boundingBox();
    await this.page.mouse.click(box.x + x, box.y + y);
  }

  /** Clicks and gives what the card says then: component, place in millimetres, where its ring is; `null` without a card. */
  async inspect(x, y) {
    await this.close();
    await this.clickAt(x, y);
    return this.read();
  }

  /** What the card says, once there is one or it is said that nothing lies there. */
  async read() {
    const status = this.page.getByTestId('inspect-status');
    await this.page.waitForFunction(() => document.querySelector('[data-testid=inspect-status]')?.textContent !== '', null, { timeout: 20_000 });
    if (/Nothing lies there/.test(await status.innerText())) return null;
    return this.card.evaluate((card) => ({
      component: Number(card.dataset.component),
      mm: ['xMm', 'yMm', 'zMm'].map((name) => Number(card.dataset[name])),
      surface: card.dataset.surface,
      name: card.querySelector('h2').textContent,
      text: card.textContent,
    }));
  }

  /** Closes the card by its key. */
  async close() {
    await this.page.mouse.move(2, 2);
    await this.viewer.canvas.focus();
    await this.page.keyboard.press('Escape');
    await this.page.waitForFunction(() => document.querySelector('[data-testid=inspect-status]')?.textContent === '');
  }

  /** Middle of an element that stays at a point, in pixels of the canvas. */
  async place(id) {
    await this.page.locator(`[data-testid=${id}][data-behind]`).waitFor({ state: 'attached' });
    return this.page.getByTestId(id).evaluate((element) => {
      const layer = element.parentElement.getBoundingClientRect();
      return ['left', 'top'].map((side, k) => (parseFloat(element.style[side]) / 100) * [layer.width, layer.height][k]);
    });
  }
}

onEveryBackend(
  'picking',
  (session, backend) => {
    let viewer, picker, ply, points, places, colors;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      await viewer.finished();
      picker = new Picker(viewer);
      await viewer.colorMode('component');
      ply = new Ply((await viewer.export('ply')).bytes);
      const columns = ['x', 'y', 'z', 'label'].map((name) => ply.column(name));
      points = columns[0].map((_, i) => ({ mm: [0, 1, 2].map((k) => columns[k][i] * 1e3), label: columns[3][i] }));
      colors = ply.classes.filter((c) => c.id > 0);
      const picture = await viewer.picture();
      places = picture.insides(colors.map((c) => c.color), MARGIN).map(({ x, y, color }) => ({ x, y, id: colors[color].id }));
      // Under the bar of the overlay nothing can be clicked.
      places = places.filter(({ y }) => y > 60);
      assert.ok(places.length >= 20, `${places.length} places`);
    }, LIMIT);
    after(() => viewer?.close());

    /** Some places, evenly, of every component that has any. */
    const some = (count) => {
      const classes = [...new Set(places.map((place) => place.id))].map((id) => places.filter((place) => place.id === id));
      return classes.flatMap((of) => of.filter((_, i) => i % Math.ceil(of.length / count) === 0));
    };

    const nearest = (mm) => points.reduce((best, point) => (distance(point.mm, mm) < distance(best.mm, mm) ? point : best));

    it('names what the picture shows where one clicks, and the point that lies there', LIMIT, async () => {
      const seen = new Set();
      for (const { x, y, id } of some(4)) {
        const found = await picker.inspect(x, y);
        assert.ok(found, `nothing at ${x}, ${y}`);
        assert.equal(found.component, id, `${found.name} at ${x}, ${y}`);
        assert.equal(found.name, colors.find((c) => c.id === id).name);
        // It is a point of the model, of that component; files have millionths of a metre.
        const point = nearest(found.mm);
        assert.ok(distance(point.mm, found.mm) < 0.01, `${found.mm} is no point of the model`);
        assert.equal(point.label, id);
        // And the camera sees it where the person clicked, within a splat.
        const [px, py] = await picker.place('picked-ring');
        assert.ok(Math.hypot(px - x, py - y) <= 6, `clicked ${x}, ${y}; it lies at ${px.toFixed(1)}, ${py.toFixed(1)}`);
        assert.match(found.text, /Uncertainty \(sigma\)not known/, 'nobody estimated it in the virtual cell');
        seen.add(id);
      }
      assert.ok(seen.size >= 3, `${seen.size} components were clicked`);
    });

    it('finds nothing in the background, and says so', LIMIT, async () => {
      assert.equal(await picker.inspect(8, 200), null);
      assert.equal(await picker.card.count(), 0);
    });

    it('takes a drag for a drag', LIMIT, async () => {
      await picker.close();
      const box = await viewer.canvas.boundingBox();
      const { x, y } = places[places.length >> 1];
      const frames = Number((await viewer.state()).frames);
      await viewer.page.mouse.move(box.x + x, box.y + y);
      await viewer.page.mouse.down();
      await viewer.page.mouse.move(box.x + x + 40, box.y + y, { steps: 4 });
      await viewer.page.mouse.move(box.x + x, box.y + y, { steps: 4 });
      await viewer.page.mouse.up();
      await viewer.until((s, before) => Number(s.frames) > before, frames, 'the camera to turn', 20_000);
      await viewer.picture();
      assert.equal(await viewer.page.getByTestId('inspect-status').innerText(), '');
      assert.equal(await picker.card.count(), 0);
    });

    it('does not find what is hidden', LIMIT, async () => {
      const { x, y, id } = some(1)[0];
      assert.equal((await picker.inspect(x, y)).component, id);
      await viewer.toggle(id);
      const behind = await picker.inspect(x, y);
      assert.notEqual(behind?.component, id);
      await viewer.toggle(id);
      assert.equal((await picker.inspect(x, y)).component, id);
    });

    it('shows what a mouse rests on', LIMIT, async () => {
      await picker.close();
      const { x, y, id } = places[places.length >> 1];
      const box = await viewer.canvas.boundingBox();
      await viewer.page.mouse.move(box.x + x, box.y + y, { steps: 3 });
      const hover = viewer.page.getByTestId('hover').locator('.pin-text');
      await hover.waitFor({ state: 'visible', timeout: 20_000 });
      assert.match(await hover.innerText(), new RegExp(colors.find((c) => c.id === id).name, 'i'));
      await viewer.page.mouse.move(box.x + 8, box.y + 300);
      await hover.waitFor({ state: 'detached', timeout: 20_000 });
    });

    it('pins labels that stay at their points and are hidden behind the model', LIMIT, async () => {
      const { page } = viewer;
      const { x, y } = some(2)[1];
      await picker.inspect(x, y);
      await page.getByTestId('inspect-pin').click();
      const label = page.getByTestId('label-1');
      await label.waitFor({ state: 'attached' });
      const [px, py] = await picker.place('label-1');
      assert.ok(Math.hypot(px - x, py - y) <= 6);
      await page.locator('[data-testid=label-1][data-occluded=false]').waitFor({ state: 'attached', timeout: 20_000 });
      await picker.close();
      await viewer.redrawn(() => page.keyboard.press('ArrowLeft'));
      const [moved] = await picker.place('label-1');
      assert.ok(Math.abs(moved - px) > 1, 'it turns with the model');
      // Half a turn: a drag over the height of the view.
      const box = await viewer.canvas.boundingBox();
      await viewer.redrawn(async () => {
        await page.mouse.move(box.x + 300, box.y + 300);
        await page.mouse.down();
        await page.mouse.move(box.x + 300 + box.height / 2, box.y + 300, { steps: 3 });
        await page.mouse.move(box.x + 300 + box.height - 40, box.y + 300, { steps: 3 });
        await page.mouse.up();
      });
      await page.locator('[data-testid=label-1][data-occluded=true]').waitFor({ state: 'attached', timeout: 20_000 });
      assert.equal(await label.locator('.pin-text').isVisible(), false);
      await page.locator('[data-testid=labels]').getByRole('button', { name: 'Remove label 1' }).click();
      await label.waitFor({ state: 'detached' });
      assert.equal(await page.getByTestId('labels').count(), 0);
      await page.keyboard.press('1');
      await viewer.picture();
    });

    it('measures the distance between two points, and its axes', LIMIT, async () => {
      const { page } = viewer;
      const [a, b] = [some(1)[0], some(1).at(-1)];
      const ends = [await picker.inspect(a.x, a.y), await picker.inspect(b.x, b.y)].map((found) => found.mm);
      await picker.close();
      await page.getByTestId('measure-distance').click();
      assert.match(await page.getByTestId('measure-prompt').innerText(), /first point/);
      const before = await viewer.picture();
      await picker.clickAt(a.x, a.y);
      await page.getByTestId('measure-prompt').getByText('second point').waitFor({ timeout: 20_000 });
      await picker.clickAt(b.x, b.y);
      const entry = page.getByTestId('measurement-1');
      await entry.waitFor({ timeout: 20_000 });
      const { mm, uncertainty } = await entry.evaluate((element) => ({ ...element.dataset }));
      assert.ok(Math.abs(mm - distance(...ends)) < 1e-3, `${mm} mm between ${ends}`);
      // Half a voxel to either side of either end: 0.82 voxels at k = 2.
      const voxel = Number(uncertainty) / Math.sqrt(2 / 3);
      assert.ok(voxel > 0.3 && voxel < 5, `a voxel of ${voxel} mm`);
      const text = (await entry.innerText()).replaceAll('\u2212', '-');
      const axes = text.match(/x (-?[\d.]+), y (-?[\d.]+), z (-?[\d.]+)/).slice(1).map(Number);
      axes.forEach((way, k) => assert.ok(Math.abs(way - (ends[1][k] - ends[0][k])) < 0.06, `${text}: axis ${k}`));
      assert.match(text, new RegExp(`${Number(mm).toFixed(1)} ± ${Number(uncertainty).toFixed(Number(uncertainty) < 1 ? 2 : 1)}`));
      assert.ok((await viewer.picture()).difference(before) > 0.0005, 'the line is drawn');
      await viewer.choose('measure-unit-inch');
      assert.match(await entry.innerText(), /inch/);
      await viewer.choose('measure-unit-mm');
    });

    it('copies the measurements as a table', LIMIT, async () => {
      const { page } = viewer;
      await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
      await page.getByTestId('measure-copy').click();
      await page.getByText('Copied to the clipboard').waitFor();
      const [head, line] = (await page.evaluate(() => navigator.clipboard.readText())).split(/\r?\n/).map((l) => l.split(','));
      const field = (name) => line[head.indexOf(name)];
      const mm = await page.getByTestId('measurement-1').getAttribute('data-mm');
      assert.ok(Math.abs(field('value') - mm) < 1e-3 && field('unit') === 'mm' && field('kind') === 'distance');
      const ends = [1, 2].map((i) => ['x', 'y', 'z'].map((axis) => Number(field(`${axis}${i}`))));
      assert.ok(Math.abs(distance(...ends) - mm) < 1e-3);
    });

    it('works by keyboard alone: pick, pin, measure, remove', LIMIT, async () => {
      const { page } = viewer;
      await page.getByTestId('measure-remove-all').focus();
      await page.keyboard.press('Enter');
      await page.getByTestId('measurement-1').waitFor({ state: 'detached' });
      await viewer.canvas.focus();
      for (let i = 0; i < 3; i++) await page.keyboard.press('Escape');
      assert.equal(await page.getByTestId('measure').getAttribute('data-kind'), 'none');
      await page.keyboard.press('1');
      await viewer.picture();
      assert.equal(await page.locator('.crosshair').isVisible(), true, 'the crosshair shows where Enter picks');
      await page.keyboard.press('Enter');
      const middle = await picker.read();
      assert.ok(middle, 'the model is in the middle of the view');
      await page.keyboard.press('l');
      await page.getByTestId('label-2').waitFor({ state: 'attached' });
      await page.keyboard.press('Delete');
      await page.getByTestId('label-2').waitFor({ state: 'detached' });
      await page.keyboard.press('m');
      await page.keyboard.press('Enter');
      await page.getByTestId('measure-prompt').getByText('second point').waitFor({ timeout: 20_000 });
      await page.keyboard.press('ArrowLeft');
      await viewer.picture();
      await page.keyboard.press('Enter');
      const entry = page.getByTestId('measurement-2');
      await entry.waitFor({ timeout: 20_000 });
      assert.ok(Number(await entry.getAttribute('data-mm')) > 0);
      await page.keyboard.press('Delete');
      await entry.waitFor({ state: 'detached' });
      await page.keyboard.press('g');
      assert.match(await page.getByTestId('measure-prompt').innerText(), /first side/);
      for (let i = 0; i < 3; i++) await page.keyboard.press('Escape');
      assert.equal(await picker.card.count(), 0);
    });

    it('finds the place on the mesh where that is shown', LIMIT, async () => {
      await fromTheStart(viewer);
      await viewer.choose('show-mesh');
      await viewer.until((s) => Number(s.triangles) > 1000 && s.points === '0', null, 'the mesh in the picture');
      const picture = await viewer.picture();
      const inside = picture.insides(colors.map((c) => c.color), MARGIN).filter(({ y }) => y > 60);
      const chosen = inside.filter((_, i) => i % Math.ceil(inside.length / 8) === 0);
      for (const { x, y, color } of chosen) {
        const found = await picker.inspect(x, y);
        assert.equal(found?.surface, 'mesh');
        assert.equal(found.component, colors[color].id, `${found.name} at ${x}, ${y}`);
        const away = distance(nearest(found.mm).mm, found.mm);
        assert.ok(away < VOXELS, `${found.mm}: ${away} mm from the points`);
        const [px, py] = await picker.place('picked-ring');
        assert.ok(Math.hypot(px - x, py - y) <= 1.5, `clicked ${x}, ${y}; it lies at ${px.toFixed(1)}, ${py.toFixed(1)}`);
      }
      await viewer.choose('show-points');
      await viewer.until((s) => s.triangles === '0' && Number(s.points) > 0, null, 'the points');
    });

    it('has no violation of accessibility (WCAG 2.2 AA) with a card, a label and a measurement', LIMIT, async () => {
      const { page } = viewer;
      const [a, b] = [some(1)[0], some(1).at(-1)];
      await page.keyboard.press('m');
      await picker.clickAt(a.x, a.y);
      await page.getByTestId('measure-prompt').getByText('second point').waitFor({ timeout: 20_000 });
      await picker.clickAt(b.x, b.y);
      await page.locator('[data-testid^=measurement-]').waitFor({ timeout: 20_000 });
      await page.keyboard.press('m');
      await picker.inspect(a.x, a.y);
      await page.keyboard.press('l');
      await page.evaluate(await readFile(AXE, 'utf8'));
      const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
      assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.map((n) => n.target).join('; ')}`), []);
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: {} },
);

/** The view that every test begins from. */
async function fromTheStart(viewer) {
  await viewer.canvas.focus();
  await viewer.page.keyboard.press('1');
  await viewer.picture();
}
