// The viewer as a test sees it: what its canvas says about itself (`data-*`), what a person can click, and pictures.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { newPage } from './chromium.mjs';
import { Picture } from './pixels.mjs';

/** Longest wait for the end of an inspection that is drawn by the processor. */
const FINISH_LIMIT_MS = 150_000;

/** Without a new frame for this long, the picture is at rest. */
const REST_MS = 250;

/** Everything but the canvas is made invisible for a picture: panels lie over it. */
const CANVAS_ONLY = 'body *:not(#viewport):not(:has(#viewport)) { visibility: hidden !important; }';

/** Screenshot options that add no style to the page: its content policy forbids that. */
const AS_IT_IS = { caret: 'initial', animations: 'allow' };

/** One page with the viewer. */
export class Viewer {
  /** Errors of the page: uncaught exceptions and what it logged as an error. */
  errors = [];

  constructor(page) {
    this.page = page;
    this.canvas = page.locator('#viewport');
    page.on('pageerror', (error) => this.errors.push(String(error)));
    page.on('console', (message) => message.type() === 'error' && this.errors.push(message.text()));
  }

  /** Opens `url` in a page of its own. */
  static async open(browser, url) {
    const viewer = new Viewer(await newPage(browser));
    await viewer.page.goto(url);
    // Without a GPU the canvas is there and hidden: a message stands in its place.
    await viewer.canvas.waitFor({ state: 'attached' });
    return viewer;
  }

  close() {
    return this.page.context().close();
  }

  /** The canvas's account of itself, `data-points` and the like as an object. */
  state() {
    return this.canvas.evaluate((canvas) => ({ ...canvas.dataset }));
  }

  /**
   * Waits until `condition(state)` holds, `state` as of [`Viewer.state`]; it runs in the page, so it must be
   * self-contained and takes what it needs as `argument`.
   */
  async until(condition, argument, what, limit = FINISH_LIMIT_MS) {
    const body = `(argument) => {
      const canvas = document.getElementById('viewport');
      return canvas && (${condition})({ ...canvas.dataset }, argument) ? { ...canvas.dataset } : null;
    }`;
    const deadline = Date.now() + limit;
    for (;;) {
      const state = await this.page.evaluate(`(${body})(${JSON.stringify(argument ?? null)})`);
      if (state) return state;
      if (Date.now() > deadline) {
        const now = JSON.stringify(await this.state());
        throw new Error(`waited in vain for ${what}; the canvas says ${now}, the page: ${this.errors.join('; ') || 'no error'}`);
      }
      await this.page.waitForTimeout(50);
    }
  }

  /** Waits for the last view, and until the page holds what the agent says is the whole model. */
  finished(limit = FINISH_LIMIT_MS) {
    const whole = (s) => s.phase === 'finished' && s.hash === s.agentHash && s.hash !== '0'.repeat(16);
    return this.until(whole, null, 'the whole model', limit);
  }

  /** Number of points by component class, as the legend gives them: all but those whose marks are hidden, drawn or not. */
  points() {
    const rows = this.page.locator('[data-testid^=legend-row-]');
    return rows.evaluateAll((rows) => rows.map((row) => Number(row.dataset.shown)));
  }

  /** Waits until some, but not all, of the model is there. */
  async midstream() {
    // The renderer tests itself with a point of its own before it draws the model.
    const state = await this.until((s) => s.inspection && Number(s.points) > 100, null, 'the first view');
    assert.notEqual(state.phase, 'finished', 'the inspection ended before the test could act: raise its pace');
    return state;
  }

  /** A picture of the 3D view alone, at rest. */
  async picture() {
    await this.#style(CANVAS_ONLY);
    try {
      for (let attempt = 0; attempt < 10; attempt++) {
        const { frames } = await this.#rest();
        const picture = new Picture(await this.canvas.screenshot(AS_IT_IS));
        if ((await this.state()).frames === frames) return picture;
      }
      throw new Error('the picture does not come to rest');
    } finally {
      await this.#style('');
    }
  }

  /** Chooses what colours mean: `appearance`, `component`, `confidence`, `views`, `defect`. */
  async colorMode(mode) {
    const id = `color-mode-${mode}`;
    if (await this.page.getByTestId(id).isChecked()) return;
    await this.redrawn(() => this.choose(id));
  }

  /** Chooses the radio button with this test id: a person clicks its label, the button itself is for the keyboard. */
  async choose(id) {
    await this.page.locator('label').filter({ has: this.page.getByTestId(id) }).click();
  }

  /** Shows or hides a component by its class. */
  async toggle(classId) {
    await this.redrawn(() => this.page.getByTestId(`legend-visible-${classId}`).click());
  }

  /** Does something that must show, and waits until a frame was drawn after it. */
  async redrawn(action) {
    const before = Number((await this.#rest()).frames);
    await action();
    await this.until((s, before) => Number(s.frames) > before, before, 'a new frame', 20_000);
  }

  /**
   * Waits until no frame has been drawn for a while: a moving or growing model is drawn with fewer points and samples than
   * one at rest, and frames follow until all of them are there. So do they until every place of a stroke is picked.
   */
  async #rest() {
    let last = await this.state();
    let since = Date.now();
    const deadline = since + 60_000;
    while (Date.now() - since < REST_MS) {
      if (Date.now() > deadline) throw new Error(`frames are drawn without end: ${JSON.stringify(last)}`);
      await this.page.waitForTimeout(50);
      const state = await this.state();
      if (state.frames !== last.frames || state.still !== 'true' || state.drawing === 'true') [last, since] = [state, Date.now()];
    }
    return last;
  }

  /** Clicks an export and gives back the file: its name and its bytes. */
  async export(kind) {
    const started = this.page.waitForEvent('download', { timeout: 60_000 });
    await this.page.getByTestId(`export-${kind}`).click();
    const download = await started;
    return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
  }

  /** Puts one style sheet on top of the page's own, in the way that its content policy lets a script do. */
  #style(text) {
    return this.page.evaluate((text) => {
      const sheet = new CSSStyleSheet();
      sheet.replaceSync(text);
      document.adoptedStyleSheets = text ? [sheet] : [];
    }, text);
  }

  /** Fails if the page logged an error that is not one of `expected` (patterns). */
  assertNoErrors(expected = []) {
    const surprising = this.errors.filter((text) => !expected.some((pattern) => pattern.test(text)));
    assert.deepEqual(surprising, [], 'the page logged errors');
  }
}
