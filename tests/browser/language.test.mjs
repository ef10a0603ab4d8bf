// The page in another language than English: all of it, chosen by address, person or browser, and as usable as in English.

import assert from 'node:assert/strict';
import { mkdir, readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, describe, it } from 'node:test';
import { Agent, SOURCE } from './support/agent.mjs';
import { launch, newPage } from './support/chromium.mjs';
import { misfits } from './support/layout.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const OUT = new URL('./out/', import.meta.url);
const messages = async (language) => JSON.parse(await readFile(new URL(`../../www/messages/${language}.json`, import.meta.url), 'utf8'));
const [ENGLISH, GERMAN] = await Promise.all(['en', 'de'].map(messages));
const shots = await mkdir(OUT, { recursive: true }).then(() => (page, name) => page.screenshot({ path: new URL(`language-${name}.png`, OUT).pathname, caret: 'initial', animations: 'allow' }));

/** Every text that can be read or is spoken now, the same once. */
const texts = (page) =>
  page.evaluate(() => {
    const found = new Set();
    const take = (text) => text?.trim() && found.add(text.trim().replace(/\s+/g, ' '));
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walk.nextNode()) {
      const element = walk.currentNode.parentElement;
      if (element.checkVisibility() && !element.closest('script, style, noscript')) take(walk.currentNode.data);
    }
    for (const attribute of ['aria-label', 'title', 'placeholder', 'alt', 'aria-valuetext']) {
      for (const element of document.querySelectorAll(`[${attribute}]`)) take(element.getAttribute(attribute));
    }
    return [...found];
  });

/** Names that are the same in every language. */
const NAMES = ['Semascan', 'English', 'Deutsch', 'PLY', 'GLB', 'OBJ', 'STL', 'SVG', 'DXF', 'Esc'];

/** What the agent and its files say, in the language that they have. */
const names = (page) =>
  page.evaluate(() => {
    const of = (selector, read) => [...document.querySelectorAll(selector)].map(read);
    const rows = of('[data-class-name]', (row) => row.dataset.className);
    return [...rows, ...of('.subject-part, .subject-source, .scale-classes li, [data-testid=reference], [data-testid=finding-class] option', (e) => e.textContent.trim())];
  });

const values = (message) => (typeof message === 'string' ? [message] : [message.one, message.other]);
const UNCHANGED = new Set(Object.keys(ENGLISH).flatMap((key) => values(ENGLISH[key]).filter((text) => values(GERMAN[key]).includes(text))).map((text) => text.trim()));

/** Texts of en.json that are others in German, as patterns; those that are little more than placeholders match anything. */
const PATTERNS = Object.entries(ENGLISH).flatMap(([key, message]) =>
  values(message)
    .filter((text) => !values(GERMAN[key]).includes(text) && /[a-z]{4}/i.test(text.replace(/\{\w+\}/g, '')))
    .map((text) => new RegExp(`^${text.trim().replace(/[.*+?^$()|[\]\\]/g, '\\$&').replace(/\{\w+\}/g, '.+')}$`)),
);

/** What is English among German texts: a text of en.json, or one that the page has in English, too. */
function leftOver(german, english, own) {
  const known = new Set([...NAMES, ...own]);
  const inEnglish = new Set(english);
  const isWords = (text) => /\p{L}{3}/u.test(text) && !known.has(text) && !UNCHANGED.has(text);
  return german.filter((text) => isWords(text) && (inEnglish.has(text) || PATTERNS.some((pattern) => pattern.test(text))));
}

const violations = async (page) => {
  await page.evaluate(await readFile(AXE, 'utf8'));
  const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
  return found.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.map((n) => n.target).join('; ')}`);
};

const language = (page) => page.evaluate(() => document.documentElement.lang);

onEveryBackend(
  'the viewer in German',
  (session, backend) => {
    let german, english;
    before(async () => {
      german = await Viewer.open(session.browser, `${session.agent.url}/?language=de`);
      await german.finished();
    }, LIMIT);
    after(async () => {
      await german?.close();
      await english?.close();
    });

    /** Opens what there is, and gives back every text that was seen on the way. */
    const tour = async (viewer) => {
      const { page } = viewer;
      const seen = new Set();
      const look = async () => (await texts(page)).forEach((text) => seen.add(text));
      const modes = await page.locator('[data-testid^=color-mode-]').evaluateAll((all) => all.map((radio) => radio.value));
      for (const mode of modes) {
        await viewer.colorMode(mode);
        await look();
      }
      await page.evaluate(() => document.querySelectorAll('details').forEach((fold) => (fold.open = true)));
      await viewer.choose('show-mesh');
      await page.locator('[data-testid=mesh][data-state=ready]').waitFor({ timeout: 120_000 });
      const { bytes } = await viewer.export('mesh-ply');
      await page.getByTestId('reference-file').setInputFiles({ name: 'reference.ply', mimeType: 'application/octet-stream', buffer: bytes });
      await page.getByTestId('deviation').waitFor({ timeout: 60_000 });
      await viewer.choose('color-mode-deviation');
      await look();
      await page.getByTestId('section-plane').click();
      await page.locator('[data-testid=section][data-state=cut]').waitFor({ timeout: 60_000 });
      await page.getByTestId('section-box').click();
      await page.getByTestId('section-read').click();
      await look();
      await page.getByTestId('section-reset').click();
      await page.getByTestId('fit').click();
      for (const tool of ['correct-brush', 'correct-outline', 'ruling-rework']) {
        await page.getByTestId(tool).click();
        await look();
      }
      await page.getByTestId('draft-cancel').click();
      await page.getByTestId('correct-outline').click();
      await viewer.canvas.focus();
      await page.keyboard.press('Enter');
      await page.getByTestId('inspect-card').waitFor();
      await page.keyboard.press('l');
      await page.getByTestId('labels').waitFor();
      await page.keyboard.press('e');
      await page.getByTestId('evidence').waitFor();
      await look();
      await page.getByTestId('evidence-close').click();
      await page.getByTestId('measure-cylinder').click();
      await look();
      await page.getByTestId('measure-distance').click();
      await viewer.canvas.focus();
      await page.keyboard.press('Enter');
      await look();
      await page.keyboard.press('Escape');
      await page.keyboard.press('Escape');
      await page.getByTestId('view-1').click();
      await page.getByTestId('view-detail').waitFor();
      await look();
      for (const dialog of ['help', 'palette']) {
        await page.getByTestId(`${dialog}-open`).click();
        await look();
        await page.keyboard.press('Escape');
      }
      return [...seen];
    };

    it('has no English left, and writes numbers as Germans do', { timeout: 480_000 }, async () => {
      const own = await names(german.page);
      const inGerman = await tour(german);
      await shots(german.page, backend);
      own.push(...(await names(german.page)));
      english = await Viewer.open(session.browser, session.agent.url);
      await english.finished();
      const inEnglish = await tour(english);
      assert.ok(inGerman.length > 250, `${inGerman.length} texts`);
      for (const text of ['Prüfung', 'Befunde', 'Messen', 'Schnitt', 'Oberfläche', 'Abweichung', 'Komponenten', 'Darstellung', 'Tastatur und Zeiger', 'Modell einpassen']) {
        assert.ok(inGerman.includes(text), text);
      }
      assert.deepEqual(leftOver(inGerman, inEnglish, own), []);
      assert.ok(inGerman.some((text) => /\d,\d+\s(mm|cm²)/.test(text)), 'no decimal comma');
      assert.deepEqual(inGerman.filter((text) => /\d\.\d+\s(mm|cm²|s|ms|MB)/.test(text)), []);
    });

    it('has what axe wants, with help and palette, too', LIMIT, async () => {
      const { page } = german;
      assert.equal(await language(page), 'de');
      assert.deepEqual(await violations(page), []);
      for (const dialog of ['help', 'palette']) {
        await page.getByTestId(`${dialog}-open`).click();
        await shots(page, `${dialog}-${backend}`);
        assert.deepEqual(await violations(page), [], dialog);
        await page.keyboard.press('Escape');
      }
    });

    it('is chosen by a person, by keyboard and by command, and stays', LIMIT, async () => {
      const viewer = await Viewer.open(session.browser, `${session.agent.url}/?theme=dark`);
      const { page } = viewer;
      const title = (text) => page.locator('#progress-title', { hasText: text }).waitFor({ timeout: 60_000 });
      await title('Inspection');
      await page.keyboard.press('?');
      assert.equal(await page.getByTestId('language-en').getAttribute('aria-pressed'), 'true');
      await page.getByTestId('language-de').focus();
      await page.keyboard.press('Enter');
      await title('Prüfung');
      assert.equal(new URL(page.url()).search, '?theme=dark');
      await page.reload();
      await title('Prüfung');
      await page.keyboard.press('Control+k');
      await page.keyboard.type('english');
      await page.keyboard.press('Enter');
      await title('Inspection');
      // What the address asks for counts more than the choice, until the person chooses again.
      await page.goto(`${session.agent.url}/?language=de`);
      await title('Prüfung');
      await page.keyboard.press('?');
      await page.getByTestId('language-en').click();
      await title('Inspection');
      assert.equal(new URL(page.url()).search, '');
      viewer.assertNoErrors();
      await viewer.close();
    });

    it('is English where the address asks for a language that there is not, and says so', LIMIT, async () => {
      const viewer = await Viewer.open(session.browser, `${session.agent.url}/?language=tlh`);
      await viewer.page.getByTestId('notice').filter({ hasText: 'language=tlh is not known; use de, en.' }).waitFor();
      assert.equal(await language(viewer.page), 'en');
      await viewer.close();
    });

    it('logs no error', LIMIT, () => german.assertNoErrors());
  },
  { agent: {}, backends: ['webgl2'] },
);

describe('German pages', () => {
  let agent, browser;
  before(async () => {
    agent = await Agent.start();
    browser = await launch('webgl2');
  }, LIMIT);
  after(async () => {
    await browser?.close();
    await agent?.stop();
  }, LIMIT);

  for (const size of [{ width: 320, height: 640 }, { width: 1440, height: 900 }]) {
    it(`fit ${size.width} pixels, and come where the browser prefers German`, LIMIT, async () => {
      const page = await newPage(browser, size, 'de-DE');
      const viewer = new Viewer(page);
      await page.goto(agent.url);
      await viewer.finished();
      assert.equal(await language(page), 'de');
      await viewer.colorMode('confidence');
      await shots(page, `${size.width}`);
      assert.deepEqual(await misfits(page), { small: [], wide: [], scroll: 0 });
      await page.getByTestId('help-open').click();
      const wide = await page.getByTestId('help').evaluate((dialog) => dialog.scrollWidth - dialog.clientWidth);
      assert.equal(wide, 0, 'the help scrolls sideways');
      await shots(page, `help-${size.width}`);
      await page.context().close();
    });
  }

  for (const name of ['login', 'inspections']) {
    it(`${name}.html speaks German, and English when it is chosen`, LIMIT, async () => {
      const page = await newPage(browser, { width: 1280, height: 800 }, 'de-DE');
      await page.goto(`${agent.url}/${name}.html`);
      const button = (code) => page.locator(`#languages [lang=${code}]`);
      await button('en').waitFor();
      await page.waitForFunction(() => document.documentElement.lang === 'de');
      await page.waitForLoadState('networkidle');
      const german = await texts(page);
      await shots(page, name);
      assert.deepEqual(await violations(page), []);
      assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth), 0);
      await button('en').focus();
      await page.keyboard.press('Enter');
      await page.waitForFunction(() => document.querySelector('#languages [lang=en]')?.getAttribute('aria-pressed') === 'true');
      await page.waitForLoadState('networkidle');
      assert.deepEqual(leftOver(german, await texts(page), ['starter motor 7', SOURCE]), []);
      assert.equal(await language(page), 'en');
      await page.context().close();
    });
  }
});
