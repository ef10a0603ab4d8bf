// The viewer as a test sees it: what its canvas says about itself (`data-*`), what a person can click, and pictures.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { newPage } from './chromium.mjs';
import { Picture } from './pixels.mjs';

/** Longest wait for the end of an inspection that is drawn by the processor. */
const FINISH_LIMIT_MS = 150_000;

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
    await viewer.canvas.waitFor();
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

  /** Waits for the last view. */
  finished() {
    return this.until((s) => s.phase === 'finished' && Number(s.points) > 0, null, 'the end of the inspection');
  }

  /** Waits until some, but not all, of the model is there. */
  async midstream() {
    const state = await this.until((s) => Number(s.points) > 0, null, 'the first points');
    assert.notEqual(state.phase, 'finished', 'the inspection ended before the test could act: raise its pace');
    return state;
  }

  /** A picture of the 3D view alone, once it no longer changes. */
  async picture() {
    await this.#style(CANVAS_ONLY);
    try {
      let previous = null;
      for (let attempt = 0; attempt < 40; attempt++) {
        const picture = new Picture(await this.canvas.screenshot(AS_IT_IS));
        if (previous && picture.equals(previous)) return picture;
        previous = picture;
        await this.page.waitForTimeout(150);
      }
      throw new Error('the picture does not come to rest');
    } finally {
      await this.#style('');
    }
  }

  /** Chooses what colours mean: `appearance`, `component`, `confidence`, `views`, `defect`. */
  async colorMode(mode) {
    // A person clicks the label; the radio button itself is for the keyboard.
    await this.page.locator('label').filter({ has: this.page.getByTestId(`color-mode-${mode}`) }).click();
  }

  /** Shows or hides a component by its class. */
  async toggle(classId) {
    await this.page.getByTestId(`legend-visible-${classId}`).click();
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
