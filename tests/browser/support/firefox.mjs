// Firefox with a software rasterizer, driven by Puppeteer over WebDriver BiDi: Playwright drives only a Firefox of its own.
// Without a screen Firefox has no WebGL2, so that it is given one of X in memory.

import { spawn } from 'node:child_process';
import { once } from 'node:events';
import puppeteer from 'puppeteer-core';
import { VIEWPORT } from './chromium.mjs';
import { Picture } from './pixels.mjs';

const EXECUTABLE = process.env.SEMASCAN_FIREFOX ?? '/usr/bin/firefox-esr';

/** How long the screen may take until it is there. */
const START_LIMIT_MS = 20_000;

/** Without a new frame for this long, the picture is at rest. */
const REST_MS = 500;

/** A running Firefox and the screen in memory that it draws on. */
export class Firefox {
  static async launch() {
    const firefox = new Firefox();
    // Xvfb itself finds a free number and tells it on a descriptor.
    const args = ['-displayfd', '3', '-screen', '0', '1400x1000x24', '-nolisten', 'tcp'];
    firefox.screen = spawn('Xvfb', args, { stdio: ['ignore', 'ignore', 'ignore', 'pipe'] });
    const failed = once(firefox.screen, 'error').then(([error]) => Promise.reject(error));
    const late = new Promise((_, reject) => setTimeout(() => reject(new Error('Xvfb does not start')), START_LIMIT_MS).unref());
    const [number] = await Promise.race([once(firefox.screen.stdio[3], 'data'), failed, late]);
    firefox.browser = await puppeteer.launch({
      browser: 'firefox',
      executablePath: EXECUTABLE,
      headless: false,
      defaultViewport: VIEWPORT,
      env: { ...process.env, DISPLAY: `:${String(number).trim()}`, LIBGL_ALWAYS_SOFTWARE: '1', MOZ_DISABLE_AUTO_SAFE_MODE: '1' },
      extraPrefsFirefox: { 'webgl.force-enabled': true, 'ui.systemUsesDarkTheme': 1, 'intl.accept_languages': 'en-GB' },
    });
    return firefox;
  }

  async close() {
    await this.browser?.close();
    this.screen.kill();
  }
}

/** One page with the viewer, in Firefox. */
export class FirefoxViewer {
  /** Errors of the page: uncaught exceptions and what it logged as an error. */
  errors = [];

  static async open(browser, url) {
    const viewer = new FirefoxViewer();
    viewer.page = await browser.newPage();
    viewer.page.on('pageerror', (error) => viewer.errors.push(String(error)));
    viewer.page.on('console', (message) => message.type() === 'error' && viewer.errors.push(message.text()));
    await viewer.page.goto(url);
    await viewer.page.waitForSelector('#viewport');
    return viewer;
  }

  /** The canvas's account of itself, `data-points` and the like as an object. */
  state() {
    return this.page.$eval('#viewport', (canvas) => ({ ...canvas.dataset }));
  }

  /** Waits until `condition(state)` holds, `state` as of [`FirefoxViewer.state`]. */
  async until(condition, what, limit = 150_000) {
    const deadline = Date.now() + limit;
    for (;;) {
      const state = await this.state();
      if (condition(state)) return state;
      if (Date.now() > deadline) {
        throw new Error(`waited in vain for ${what}; the canvas says ${JSON.stringify(state)}, the page: ${this.errors.join('; ') || 'no error'}`);
      }
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }

  /** Waits for the last view, and until the page holds what the agent says is the whole model. */
  finished() {
    return this.until((s) => s.phase === 'finished' && s.hash === s.agentHash && s.hash !== '0'.repeat(16), 'the whole model');
  }

  /** The element with a test id, once it can be seen. */
  byId(id) {
    return this.page.waitForSelector(`[data-testid="${id}"]`, { visible: true, timeout: 60_000 });
  }

  /** Clicks what has a test id; of a radio button its label, the button itself is for the keyboard. */
  async click(id) {
    await this.page.waitForSelector(`[data-testid="${id}"]`, { timeout: 60_000 });
    await this.page.$eval(`[data-testid="${id}"]`, (element) => (element.type === 'radio' ? element.closest('label') : element).click());
  }

  /** A picture of the canvas at rest; what lies over it is made invisible for it. */
  async picture() {
    await this.#atRest();
    await this.#hideOthers(true);
    try {
      const canvas = await this.page.$('#viewport');
      return new Picture(Buffer.from(await canvas.screenshot({ type: 'png' })));
    } finally {
      await this.#hideOthers(false);
    }
  }

  async #atRest() {
    let [last, since] = [await this.state(), Date.now()];
    const deadline = since + 60_000;
    while (Date.now() - since < REST_MS) {
      if (Date.now() > deadline) throw new Error('frames are drawn without end');
      await new Promise((resolve) => setTimeout(resolve, 100));
      const state = await this.state();
      if (state.frames !== last.frames || state.still !== 'true') [last, since] = [state, Date.now()];
    }
  }

  #hideOthers(hidden) {
    return this.page.evaluate((hidden) => {
      const sheet = new CSSStyleSheet();
      sheet.replaceSync('body *:not(#viewport):not(:has(#viewport)) { visibility: hidden !important; }');
      document.adoptedStyleSheets = hidden ? [sheet] : [];
    }, hidden);
  }
}
