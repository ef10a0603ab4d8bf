// What the page says is true: of what is not known, of a lost connection, of a viewer that has stopped, of what is shown.

import assert from 'node:assert/strict';
import { after, before, describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { launch } from './support/chromium.mjs';
import { Ply } from './support/ply.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

describe('the page', () => {
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

  it('gives confidence a scale of the data and a colour to what is not known', LIMIT, async () => {
    await viewer.colorMode('confidence');
    const scale = viewer.page.getByTestId('color-scale');
    const [low, , high] = (await scale.locator('.scale-ticks span').allInnerTexts()).map((text) => parseFloat(text.replace(/[^0-9.]/g, '')));
    assert.ok(low < high && high <= 100, `${low} to ${high} %`);
    const ply = new Ply((await viewer.export('ply')).bytes);
    const labels = ply.column('label');
    const known = ply.column('confidence').filter((_, i) => labels[i] > 0).map((share) => 100 * share);
    const outside = known.filter((share) => share < low - 0.5 || share > high + 0.5).length;
    assert.ok(outside <= 0.05 * known.length, `${outside} of ${known.length} points are beyond ${low} to ${high} %`);
    assert.ok(await viewer.page.getByTestId('scale-unknown').isVisible());
  });

  it('does not call labels certain that nobody estimated the uncertainty of', LIMIT, async () => {
    // The virtual cell's own labels carry none.
    const ply = new Ply((await viewer.export('ply')).bytes);
    assert.ok(ply.column('sigma').every((sigma) => sigma === 0), 'the source of this test estimates it after all');
    await viewer.colorMode('sigma');
    const unknown = viewer.page.getByTestId('scale-unknown');
    assert.match(await unknown.innerText(), /not known/);
    assert.equal(await viewer.page.locator('[data-testid=color-scale] .scale-ramp').count(), 0);
    assert.ok((await viewer.picture()).coloured() < 1000, 'there are colours of a scale, not of the axes alone');
  });

  it('keeps the meaning of colours over a reload', LIMIT, async () => {
    await viewer.colorMode('views');
    await viewer.page.reload();
    await viewer.finished();
    assert.ok(await viewer.page.getByTestId('color-mode-views').isChecked());
  });

  it('says which points are shown and exported, and why others are not', LIMIT, async () => {
    const note = viewer.page.getByTestId('export-note');
    const { points, held } = await note.evaluate((element) => ({ ...element.dataset }));
    const ply = new Ply((await viewer.export('ply')).bytes);
    assert.equal(ply.count, Number(points));
    const said = (await note.innerText()).replaceAll(/[\s\u00a0\u202f,](?=\d{3})/g, '');
    if (held !== points) {
      assert.ok(said.includes(points) && said.includes(held), said);
      const reasons = [...said.matchAll(/(\d+) (?:of components|stray|outside)/g)].map((match) => Number(match[1]));
      assert.equal(reasons.reduce((sum, n) => sum + n, 0), held - points, said);
    }
    await viewer.toggle(1);
    assert.match(await note.innerText(), /of components that are switched off/);
    await viewer.toggle(1);
  });

  it('ships the entry points of the page and its workers and nothing for tests', LIMIT, async () => {
    const shipped = await viewer.page.evaluate(async () => ({
      // Those of Leptos's streams aside.
      entries: Object.keys(await import('/semascan_viewer.js')).filter((name) => !/^IntoUnderlying/.test(name)).sort(),
      globals: Object.keys(window).filter((name) => /semascan|test/i.test(name)),
      viewer: Object.getOwnPropertyNames((await import('/semascan_viewer.js')).Viewer.prototype).sort(),
    }));
    assert.deepEqual(shipped.entries, ['Viewer', 'default', 'export_worker_start', 'initSync', 'link_worker_start', 'mesh_worker_start', 'player_worker_start', 'speak', 'start']);
    assert.deepEqual(shipped.globals, []);
    // A SpaceMouse is read by a script of its own, which moves the camera by these.
    assert.deepEqual(shipped.viewer.filter((name) => !name.startsWith('__')), ['constructor', 'fit', 'free', 'move_puck', 'puck_is_there']);
  });

  it('says that it has stopped after a panic, and no longer that it is connected', LIMIT, async () => {
    const broken = await Viewer.open(browser, agent.url);
    await broken.until((s) => s.connection === 'connected', null, 'the connection', 60_000);
    // What a panic ends in: an unreachable instruction of the module.
    await broken.page.evaluate(() => {
      const code = [0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 7, 5, 1, 1, 102, 0, 0, 10, 5, 1, 3, 0, 0, 11];
      const { exports } = new WebAssembly.Instance(new WebAssembly.Module(new Uint8Array(code)));
      setTimeout(exports.f);
    });
    const alert = broken.page.locator('#failure');
    await alert.waitFor({ state: 'visible', timeout: 5000 });
    assert.match(await alert.innerText(), /has stopped[^]*reload/i);
    const link = broken.page.getByTestId('connection');
    assert.equal(await link.getAttribute('data-state'), 'broken');
    assert.equal((await link.innerText()).trim(), 'Stopped');
    assert.doesNotMatch(await broken.page.locator('body').innerText(), /RuntimeError|unreachable/);
    await broken.close();
  });

  it('says so where the part that receives the model fails', LIMIT, async () => {
    const context = await browser.newContext({ viewport: { width: 960, height: 600 } });
    const page = await context.newPage();
    await page.route('**/link_worker.js', (route) =>
      route.fulfill({ contentType: 'text/javascript', body: 'throw new WebAssembly.RuntimeError("unreachable executed");' }),
    );
    await page.goto(agent.url);
    const message = page.getByTestId('viewport-message');
    await page.locator('[data-testid=viewport-message][data-state=broken]').waitFor({ timeout: 60_000 });
    assert.match(await message.innerText(), /The viewer has stopped[^]*internal error/);
    assert.doesNotMatch(await message.innerText(), /RuntimeError|unreachable/);
    await context.close();
  });
});

describe('a lost agent', () => {
  it('is not said to be running', LIMIT, async () => {
    const agent = await Agent.start({ pace: 2 });
    const browser = await launch('webgl2');
    try {
      const viewer = await Viewer.open(browser, agent.url);
      await viewer.midstream();
      assert.equal(await viewer.page.getByTestId('phase').getAttribute('data-phase'), 'running');
      await agent.kill();
      await viewer.until((s) => s.connection !== 'connected', null, 'the page to notice', 20_000);
      const progress = viewer.page.getByTestId('progress');
      assert.equal(await progress.getAttribute('data-phase'), 'interrupted');
      assert.doesNotMatch(await progress.innerText(), /running/i);
      assert.equal(await viewer.page.locator('.stage-row.is-active, .meter.is-unknown').count(), 0, 'something still moves');
      assert.match(await viewer.page.getByTestId('banner').innerText(), /out of date/);
    } finally {
      await browser.close();
      await agent.stop();
    }
  });
});
