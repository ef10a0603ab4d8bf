// The main path in Firefox, on WebGL2: a part is captured and seen, coloured, picked, judged, meshed and saved.

import assert from 'node:assert/strict';
import { after, before, describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { VIEWPORT } from './support/chromium.mjs';
import { Firefox, FirefoxViewer } from './support/firefox.mjs';
import { Ply } from './support/ply.mjs';
import { LIMIT } from './support/session.mjs';

describe('Firefox', () => {
  let agent, firefox, viewer, page, ply;
  before(async () => {
    agent = await Agent.start({ pace: 1 });
    firefox = await Firefox.launch();
    viewer = await FirefoxViewer.open(firefox.browser, agent.url);
    page = viewer.page;
  }, LIMIT);
  after(async () => {
    await firefox?.close();
    await agent?.stop();
  }, LIMIT);

  it('shows the model while it grows, and then whole', LIMIT, async () => {
    const early = await viewer.until((s) => s.inspection && Number(s.points) > 100, 'the first view');
    assert.equal(early.backend, 'webgl2');
    const whole = await viewer.finished();
    assert.ok(Number(whole.received ?? whole.points) >= Number(early.points));
    const picture = await viewer.picture();
    assert.ok(picture.drawn() > 0.03 * VIEWPORT.width * VIEWPORT.height, `${picture.drawn()} pixels were drawn on`);
    assert.ok(picture.coloured() > 500, `${picture.coloured()} coloured pixels`);
  });

  it('shows something else in every colour mode', LIMIT, async () => {
    const pictures = new Map();
    for (const mode of ['appearance', 'component', 'confidence', 'views']) {
      await viewer.click(`color-mode-${mode}`);
      const picture = await viewer.picture();
      for (const [other, before] of pictures) assert.ok(picture.difference(before) > 0.01, `${mode} looks like ${other}`);
      pictures.set(mode, picture);
    }
  });

  it('saves the points with their labels', LIMIT, async () => {
    // What the page would save is read here: a dialogue of the browser's is none of ours.
    await page.evaluate(() => {
      const make = URL.createObjectURL.bind(URL);
      URL.createObjectURL = (blob) => ((window.savedFile = blob), make(blob));
    });
    await viewer.click('export-ply');
    await page.waitForFunction(() => window.savedFile?.size > 1000, { timeout: 60_000 });
    const base64 = await page.evaluate(async () => {
      const bytes = new Uint8Array(await window.savedFile.arrayBuffer());
      let text = '';
      for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
      return btoa(text);
    });
    ply = new Ply(Buffer.from(base64, 'base64'));
    assert.ok(ply.column('x').length > 1000);
    assert.ok(new Set(ply.column('label')).size >= 3, 'several components');
  });

  it('says what lies where one clicks', LIMIT, async () => {
    await viewer.click('color-mode-component');
    const classes = ply.classes.filter((one) => one.id > 0);
    const places = (await viewer.picture()).insides(classes.map((one) => one.color), 5).filter(({ y }) => y > 60);
    assert.ok(places.length > 3, `${places.length} places`);
    const box = await (await page.$('#viewport')).boundingBox();
    let right = 0;
    for (const { x, y, color } of places.slice(0, 5)) {
      await page.mouse.click(box.x + x, box.y + y);
      const card = await viewer.byId('inspect-card');
      right += (await card.evaluate((card) => Number(card.dataset.component))) === classes[color].id;
      await page.focus('#viewport');
      await page.keyboard.press('Escape');
      await page.waitForFunction(() => !document.querySelector('[data-testid=inspect-card]'), { timeout: 20_000 });
    }
    assert.ok(right >= 4, `${right} of 5 as the picture shows them`);
  });

  it('takes a decision by keyboard, and the agent keeps it', LIMIT, async () => {
    await viewer.byId('finding-1');
    await page.focus('#viewport');
    // From the last finding to the first.
    const isChosen = () => page.$eval('[data-testid=finding-1]', (row) => row.getAttribute('aria-pressed') === 'true');
    for (let steps = 0; steps < 100 && !(await isChosen()); steps++) await page.keyboard.press('k');
    assert.ok(await isChosen(), 'the first finding is chosen');
    await page.keyboard.press('x');
    await viewer.byId('draft-form');
    await page.keyboard.type('a crack');
    await page.keyboard.press('Tab');
    await page.keyboard.type('Kim');
    await page.keyboard.press('Enter');
    await page.waitForFunction(() => document.querySelector('[data-testid=finding-1] .decision')?.dataset.decision === 'reject', { timeout: 30_000 });
    const { items } = await page.evaluate(async () => {
      const id = document.getElementById('viewport').dataset.inspection;
      return (await fetch(`/api/v1/inspections/${id}/reviews`)).json();
    });
    assert.deepEqual(items.map(({ review }) => [review.action.type, review.person]), [['reject', 'Kim']]);
  });

  it('shows the mesh', LIMIT, async () => {
    const before = await viewer.picture();
    await viewer.click('show-mesh');
    await page.waitForSelector('[data-testid=mesh][data-state=ready]', { timeout: 120_000 });
    const after = await viewer.picture();
    assert.ok(after.difference(before) > 0.005, `${after.difference(before)} of the pixels differ`);
    assert.deepEqual(viewer.errors, []);
  });
});
