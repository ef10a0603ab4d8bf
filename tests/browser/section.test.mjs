// A section plane and a box: what they cut away is gone from the picture and cannot be picked, the outlines agree with their
// drawings, and thicknesses are read in them.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, it } from 'node:test';
import { Ply } from './support/ply.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

onEveryBackend(
  'the section',
  (session) => {
    let viewer, page, panel, colors;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      panel = page.getByTestId('section');
      await viewer.finished();
      await viewer.colorMode('component');
      colors = new Ply((await viewer.export('ply')).bytes).classes.filter((c) => c.id > 0).map((c) => c.color);
    }, LIMIT);
    after(() => viewer?.close());

    const plane = () => panel.getByRole('switch', { name: /^Plane/ });
    const offset = () => page.getByTestId('section-offset');
    const set = async (id, value) => {
      await page.getByTestId(id).fill(String(value));
      await page.getByTestId(id).press('Enter');
    };
    const drawn = (picture) => picture.byHue(colors).reduce((sum, n) => sum + n, 0);
    const cut = () => page.locator('[data-testid=section][data-state=cut]').waitFor({ timeout: 120_000 });
    const figures = () => page.getByTestId('section-figures').evaluate((element) => ({ length: Number(element.dataset.lengthMm), area: Number(element.dataset.areaMm2) }));
    const outlines = () => panel.evaluate((element) => ({ closed: Number(element.dataset.closed), open: Number(element.dataset.open) }));

    it('cuts points away, and what is gone cannot be picked', LIMIT, async () => {
      const whole = await viewer.picture();
      const places = whole.insides(colors, 4).filter(({ y }) => y > 70);
      await plane().check();
      await page.getByTestId('section-offset').waitFor();
      // Below the table: nothing of the model is left.
      await viewer.redrawn(() => set('section-offset', -500));
      const nothing = await viewer.picture();
      assert.ok(drawn(nothing) < 0.02 * drawn(whole), `${drawn(nothing)} of ${drawn(whole)} coloured pixels are left`);
      const { x, y } = places[Math.floor(places.length / 2)];
      const box = await viewer.canvas.boundingBox();
      await page.mouse.click(box.x + x, box.y + y);
      await page.getByTestId('inspect-status').getByText('Nothing lies there').waitFor({ timeout: 20_000 });
      // Flipped, everything is.
      await viewer.redrawn(() => page.getByTestId('section-flip').click());
      const all = await viewer.picture();
      assert.ok(drawn(all) > 0.9 * drawn(whole), `${drawn(all)} of ${drawn(whole)} coloured pixels`);
      await page.mouse.click(box.x + x, box.y + y);
      await page.getByTestId('inspect-card').waitFor({ timeout: 20_000 });
      await page.keyboard.press('Escape');
      await page.getByTestId('section-reset').click();
    });

    it('draws outlines that are where the plane is, and fills what they enclose', LIMIT, async () => {
      await plane().check();
      await cut();
      const middle = Number(await offset().inputValue());
      assert.ok(middle > 5 && middle < 300, `the plane begins at ${middle} mm, in the middle`);
      await viewer.choose('show-mesh');
      await viewer.until((s) => Number(s.triangles) > 1000, null, 'the mesh');
      const before = await viewer.picture();
      const { length, area } = await figures();
      assert.ok(length > 100 && length < 5000, `${length} mm`);
      await viewer.redrawn(() => set('section-offset', middle - 5));
      assert.ok((await viewer.picture()).difference(before) > 0.002);
      const other = await figures();
      assert.ok(other.length !== length && Math.abs(other.length - length) < 0.8 * length, `${length} mm, 5 mm lower ${other.length} mm`);
      // Anything enclosed is enclosed by something closed.
      const { closed } = await outlines();
      assert.equal(other.area > 0, closed > 0, `${other.area} mm2 of ${closed} closed outlines (${area} mm2 above)`);
    });

    it('never closes what is open', LIMIT, async () => {
      // Lengthwise the model has no underside.
      await viewer.choose('section-x');
      await cut();
      const { open } = await outlines();
      assert.ok(open > 0, 'the part was not seen from below');
      assert.match(await page.getByTestId('section-summary').innerText(), /Open ends, marked by squares/);
    });

    it('is saved as SVG and DXF that agree with the figures', LIMIT, async () => {
      await viewer.choose('section-z');
      await cut();
      const { length, area } = await figures();
      const save = async (id) => {
        const started = page.waitForEvent('download', { timeout: 60_000 });
        await page.getByTestId(id).click();
        const download = await started;
        return { name: download.suggestedFilename(), text: await readFile(await download.path(), 'utf8') };
      };
      const svg = await save('section-svg');
      assert.match(svg.name, /-section-z\.svg$/);
      const read = await page.evaluate((text) => {
        const xml = new DOMParser().parseFromString(text, 'image/svg+xml');
        const measure = (path) => {
          const element = document.createElementNS('http://www.w3.org/2000/svg', 'path');
          element.setAttribute('d', path.getAttribute('d'));
          return element.getTotalLength();
        };
        const lengths = [...xml.querySelectorAll('g.component path')].map(measure);
        return {
          error: xml.querySelector('parsererror')?.textContent,
          title: xml.querySelector('title')?.textContent,
          width: xml.documentElement.getAttribute('width'),
          length: lengths.reduce((sum, l) => sum + l, 0),
          classes: [...xml.querySelectorAll('g.component')].map((g) => g.getAttribute('stroke')),
          enclosed: xml.querySelector('#enclosed')?.getAttribute('d') ?? '',
        };
      }, svg.text);
      assert.equal(read.error, undefined);
      assert.match(read.title, /^Section of /);
      assert.match(read.width, /^[\d.]+mm$/);
      assert.ok(Math.abs(read.length - length) < 0.002 * length + 0.1, `${read.length} mm in the drawing, ${length} mm on the page`);
      const palette = colors.map((c) => `#${c.map((v) => v.toString(16).padStart(2, '0')).join('')}`);
      assert.ok(read.classes.length > 0 && read.classes.every((c) => palette.includes(c) || c === '#8c939c'), read.classes.join());
      assert.equal(read.enclosed !== '', area > 0);

      const dxf = await save('section-dxf');
      assert.match(dxf.name, /-section-z\.dxf$/);
      const lines = dxf.text.split('\r\n');
      assert.ok(dxf.text.includes('AC1009') && lines.at(-2) === 'EOF');
      assert.ok(Math.abs(polylines(lines) - length) < 0.002 * length + 0.1, `${polylines(lines)} mm in the DXF`);
    });

    it('reads how thick it is where one clicks', LIMIT, async () => {
      // Straight down on the section: the whole plane is in view.
      await viewer.canvas.focus();
      await page.keyboard.press('6');
      await page.keyboard.press('w');
      await page.getByTestId('section-prompt').getByText('Click between two lines').waitFor();
      const box = await viewer.canvas.boundingBox();
      for (const [x, y] of [[0.5, 0.55], [0.45, 0.5], [0.55, 0.6], [0.4, 0.6], [0.6, 0.5], [0.5, 0.4]]) {
        await page.mouse.click(box.x + x * box.width, box.y + y * box.height);
        await page.waitForTimeout(300);
        if (await page.locator('[data-testid=section-reading-1]').count()) break;
      }
      const reading = page.getByTestId('section-reading-1');
      await reading.waitFor({ timeout: 5_000 });
      assert.match(await reading.innerText(), /[\d.]+ ± [\d.]+\smm\s+Thickness, /);
      const thick = Number(await reading.getAttribute('data-mm'));
      assert.ok(thick > 0.5 && thick < 200, `${thick} mm`);
      await page.getByTestId('section-label-1').waitFor();
      await viewer.choose('measure-unit-inch');
      assert.match(await reading.innerText(), /inch/);
      const inches = Number((await page.getByTestId('section-label-1').innerText()).split(/\s/)[0]);
      assert.ok(Math.abs(inches * 25.4 - thick) < 0.01);
      await viewer.choose('measure-unit-mm');
      await page.keyboard.press('Escape');
      await page.keyboard.press('1');
    });

    it('has a box that cuts together with the plane', LIMIT, async () => {
      const before = await figures();
      await panel.getByRole('switch', { name: /^Box/ }).check();
      const low = Number(await page.getByTestId('section-x-from').inputValue());
      const high = Number(await page.getByTestId('section-x-to').inputValue());
      assert.ok(low < high);
      const unboxed = await viewer.picture();
      await viewer.redrawn(() => set('section-x-to', (low + high) / 2));
      const half = await figures();
      assert.ok(half.length > 0.1 * before.length && half.length < 0.9 * before.length, `${half.length} of ${before.length} mm`);
      assert.ok(half.area <= before.area);
      const boxed = await viewer.picture();
      assert.ok(drawn(boxed) < 0.9 * drawn(unboxed), `${drawn(boxed)} of ${drawn(unboxed)} coloured pixels`);
      // By keyboard as well.
      await page.getByTestId('section-x-to-slider').focus();
      await page.keyboard.press('ArrowLeft');
      assert.ok(Number(await page.getByTestId('section-x-to').inputValue()) < (low + high) / 2);
    });

    it('is worked by keyboard, and has no violation of accessibility (WCAG 2.2 AA)', LIMIT, async () => {
      await page.evaluate(await readFile(AXE, 'utf8'));
      const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
      assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.map((n) => n.target).join('; ')}`), []);
      await viewer.canvas.focus();
      const at = Number(await offset().inputValue());
      await page.keyboard.press('d');
      assert.ok(Math.abs(at - Number(await offset().inputValue()) - 1) < 2e-3, 'a millimetre deeper');
      await page.keyboard.press('Shift+U');
      assert.ok(Math.abs(at - Number(await offset().inputValue()) - 0.9) < 2e-3, 'a tenth up');
      await page.keyboard.press('s');
      await offset().waitFor({ state: 'detached' });
      assert.equal(await plane().isChecked(), false);
      await page.getByTestId('section-reset').click();
      await page.getByTestId('section-reset').waitFor({ state: 'detached' });
    });

    it('keeps its place on a page of 320 pixels', LIMIT, async () => {
      await plane().check();
      await panel.getByRole('switch', { name: /^Box/ }).check();
      await page.setViewportSize({ width: 320, height: 640 });
      const found = await panel.evaluate((panel) => {
        const small = [...panel.querySelectorAll('button, input')].map((element) => {
          const { width, height } = (element.closest('label') ?? element).getBoundingClientRect();
          return { id: element.dataset.testid, width, height };
        });
        const wide = [...panel.querySelectorAll('*')].filter((e) => e.getBoundingClientRect().right > document.documentElement.clientWidth + 1 && !e.closest('.visually-hidden'));
        return { small: small.filter((e) => Math.min(e.width, e.height) < 24), wide: wide.map((e) => e.className || e.tagName) };
      });
      assert.deepEqual(found, { small: [], wide: [] });
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: {} },
);

/** Length of all polylines of a DXF, given as its lines. */
function polylines(lines) {
  let [length, last, first, closed, code10, kind] = [0, null, null, false, 0, ''];
  const reach = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
  for (let i = 0; i + 1 < lines.length; i += 2) {
    const [code, value] = [Number(lines[i]), lines[i + 1]];
    if (code === 0) {
      if (value === 'SEQEND' && closed) length += reach(last, first);
      if (value === 'POLYLINE') [last, first, closed] = [null, null, false];
      kind = value;
    } else if (code === 70 && kind === 'POLYLINE') closed = value.trim() === '1';
    else if (code === 10) code10 = Number(value);
    else if (code === 20 && kind === 'VERTEX') {
      const at = [code10, Number(value)];
      if (last) length += reach(last, at);
      first ??= at;
      last = at;
    }
  }
  return length;
}
