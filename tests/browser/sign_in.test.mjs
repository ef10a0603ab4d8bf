// People who log in at an identity provider, which is another site: cookies come along as far as they must, and the page is back where
// one was.

import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { once } from 'node:events';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, it } from 'node:test';
import { BINARY } from './support/agent.mjs';
import { launch, newPage } from './support/chromium.mjs';
import { Provider } from './support/provider.mjs';
import { LIMIT } from './support/session.mjs';

describe('a login at an identity provider', () => {
  let root, provider, agent, url, browser, page;

  before(async () => {
    root = mkdtempSync(join(tmpdir(), 'semascan-sign-in-'));
    const cell = join(root, 'cell');
    const made = spawnSync(BINARY, ['init', cell, '--no-user'], { encoding: 'utf8' });
    assert.equal(made.status, 0, made.stderr);
    provider = await Provider.start('semascan');
    const port = await freePort();
    // Another site than the provider's: cookies tell sites apart by their hosts.
    url = `http://localhost:${port}`;
    const section = { issuer: provider.issuer, client_id: 'semascan', public_url: url, name: 'Plant' };
    const lines = Object.entries(section).map(([key, value]) => `${key} = ${JSON.stringify(value)}`);
    writeFileSync(join(root, 'oidc.toml'), `[serve.oidc]\n${lines.join('\n')}\nroles = { quality = "reviewer" }\n`);
    const args = ['serve', '--config', join(root, 'oidc.toml'), '--data', join(cell, 'data'), '--port', String(port)];
    agent = spawn(BINARY, args, { stdio: ['ignore', 'ignore', 'pipe'] });
    await listening(agent);
    browser = await launch('webgl2');
    page = await newPage(browser);
  }, LIMIT);

  after(async () => {
    await browser?.close();
    provider?.stop();
    if (agent?.exitCode === null) {
      agent.kill();
      await once(agent, 'exit');
    }
    rmSync(root, { recursive: true, force: true });
  }, LIMIT);

  const signIn = async () => {
    await page.waitForSelector('#elsewhere:not([hidden])');
    assert.equal(await page.textContent('#provider'), 'Sign in with Plant');
    await page.click('#provider');
    await page.click('#go');
  };
  const at = (path) => page.waitForURL((there) => there.origin === url && there.pathname === path, { timeout: 60_000 });

  it('is refused on a page that says why where no group has a role', LIMIT, async () => {
    await page.goto(`${url}/login.html`);
    await signIn();
    await at('/api/v1/oidc/callback');
    assert.match(await page.textContent('[role=alert]'), /none of your groups may use this agent/);
    const { width } = await page.locator('main').boundingBox();
    assert.ok(width < 400, 'the page has its style');
    await page.click('text=Back to the login');
    await at('/login.html');
  });

  it('leads back to where one was, with a session', LIMIT, async () => {
    provider.groups = ['quality'];
    await page.goto(`${url}/?theme=dark`);
    await at('/login.html');
    await signIn();
    await at('/');
    assert.equal(new URL(page.url()).search, '?theme=dark');
    await page.waitForSelector('[data-testid=connection][data-state=connected]', { timeout: 60_000 });
    assert.equal(await page.textContent('.login-link'), 'anna (Plant)');
    const cookies = await page.context().cookies(url);
    assert.deepEqual(cookies.map(({ httpOnly, sameSite }) => [httpOnly, sameSite]), [[true, 'Strict']]);
    await page.goto(`${url}/login.html`);
    await page.waitForSelector('#known:not([hidden])');
    assert.equal(await page.textContent('#who'), 'Logged in as anna (Plant) (reviewer).');
    assert.equal(await page.isVisible('#provider'), false);
  });

  it('comes to nothing where the provider takes no code, and that is said', LIMIT, async () => {
    await page.click('#logout');
    await page.waitForSelector('#elsewhere:not([hidden])');
    provider.fails = true;
    await page.click('#provider');
    await page.click('#go');
    await at('/api/v1/oidc/callback');
    assert.match(await page.textContent('[role=alert]'), /Plant cannot be asked now/);
  });
});

/** A port that nobody listens on. */
async function freePort() {
  const server = createServer().listen(0, '127.0.0.1');
  await once(server, 'listening');
  const { port } = server.address();
  server.close();
  await once(server, 'close');
  return port;
}

/** Waits until `agent` says that it listens. */
async function listening(agent) {
  let log = '';
  agent.stderr.setEncoding('utf8');
  for await (const text of agent.stderr) {
    log += text;
    if (log.includes('listening on ')) {
      agent.stderr.resume();
      return;
    }
  }
  throw new Error(`the agent ended: ${log}`);
}
