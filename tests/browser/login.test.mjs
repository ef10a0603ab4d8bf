// Users who log in: the page sends them to the login and back again, when a login ends, too, and nowhere else.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, it } from 'node:test';
import { Agent, BINARY } from './support/agent.mjs';
import { launch, newPage } from './support/chromium.mjs';
import { LIMIT } from './support/session.mjs';

const PASSWORD = 'correct-horse-battery';

describe('a login', () => {
  let root, data, agent, browser, page;

  const semascan = (args, input = '') => {
    const done = spawnSync(BINARY, args, { input, encoding: 'utf8' });
    assert.equal(done.status, 0, done.stderr);
  };

  before(async () => {
    root = mkdtempSync(join(tmpdir(), 'semascan-login-'));
    data = join(root, 'cell', 'data');
    semascan(['init', join(root, 'cell'), '--user', 'anna'], `${PASSWORD}\n`);
    agent = await Agent.start({ args: ['--login', '--users', data, '--ping-time', '0.5'] });
    browser = await launch('webgl2');
    page = await newPage(browser);
  }, LIMIT);

  after(async () => {
    await browser?.close();
    await agent?.stop();
    rmSync(root, { recursive: true, force: true });
  }, LIMIT);

  const fill = async (password) => {
    await page.fill('#name', 'Anna');
    await page.fill('#password', password);
    await page.click('#submit');
  };
  const connected = () => page.waitForSelector('[data-testid=connection][data-state=connected]', { timeout: 60_000 });
  const at = (path) => page.waitForURL((url) => url.pathname === path, { timeout: 60_000 });

  it('is asked for, and leads back to where one was', LIMIT, async () => {
    await page.goto(`${agent.url}/?theme=dark`);
    await at('/login.html');
    await fill('a wrong password');
    await page.waitForFunction(() => document.getElementById('said').textContent === 'Name or password is wrong.');
    assert.equal(await page.inputValue('#password'), '');
    assert.deepEqual(await violations(), []);
    await fill(PASSWORD);
    await at('/');
    assert.equal(new URL(page.url()).search, '?theme=dark');
    await connected();
    assert.equal(await page.textContent('.login-link'), 'anna');
    const visible = await page.evaluate(() => document.cookie);
    assert.equal(visible, '', 'no script sees the cookie');
  });

  // What axe says of the page: who cannot see it or use a mouse logs in, too.
  const violations = async () => {
    const axe = await readFile(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
    await page.evaluate(axe);
    const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa'] }));
    return found.violations.map((violation) => `${violation.id}: ${violation.help}`);
  };

  it('leads nowhere else', LIMIT, async () => {
    for (const next of ['https://evil.example/', '//evil.example', '\\\\evil.example', 'javascript:alert(1)', '/login.html']) {
      await page.context().clearCookies();
      await page.goto(`${agent.url}/login.html?next=${encodeURIComponent(next)}`);
      await fill(PASSWORD);
      await at('/');
      assert.equal(new URL(page.url()).origin, agent.url);
    }
  });

  it('ends by hand', LIMIT, async () => {
    await page.goto(`${agent.url}/login.html`);
    await page.waitForSelector('#known:not([hidden])');
    assert.equal(await page.textContent('#who'), 'Logged in as anna (admin).');
    await page.click('#logout');
    await page.waitForSelector('#login:not([hidden])');
    const me = await page.request.get(`${agent.url}/api/v1/me`);
    assert.equal(me.status(), 401);
  });

  it('is asked for again when it ends while the page is open', LIMIT, async () => {
    await page.goto(`${agent.url}/login.html`);
    await fill(PASSWORD);
    await at('/');
    await connected();
    semascan(['user', 'password', 'anna', '--data', data], 'another-horse-battery\n');
    await at('/login.html');
    await fill('another-horse-battery');
    await at('/');
    await connected();
  });
});
