// The page of one agent that follows another: only where both operators allowed it, and never without saying whose model
// it shows.

import assert from 'node:assert/strict';
import { createServer } from 'node:net';
import { once } from 'node:events';
import { after, before, describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { launch } from './support/chromium.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

describe('another agent than the one that the page came from', () => {
  let browser, own, other, closed, otherHost;

  before(async () => {
    browser = await launch('webgl2');
    // The agents name each other on their command lines, so the ports are chosen first.
    const [ownPort, otherPort] = [await freePort(), await freePort()];
    otherHost = `127.0.0.1:${otherPort}`;
    own = await Agent.start({ port: ownPort, args: ['--allow-agent', `ws://${otherHost}`, '--allow-agent', 'ws://127.0.0.1:9'] });
    other = await Agent.start({ port: otherPort, args: ['--allow-origin', `http://127.0.0.1:${ownPort}`] });
    closed = await Agent.start();
  }, LIMIT);
  after(async () => {
    await browser?.close();
    await Promise.all([own, other, closed].map((agent) => agent?.stop()));
  }, LIMIT);

  it('is followed where both operators allowed it, and named', LIMIT, async () => {
    const viewer = await Viewer.open(browser, `${own.url}/?ws=ws://${otherHost}`);
    await viewer.finished();
    const foreign = viewer.page.getByTestId('foreign-agent');
    assert.equal(await foreign.getAttribute('data-host'), otherHost);
    assert.ok((await foreign.innerText()).includes(otherHost));
    assert.ok((await viewer.page.title()).includes(otherHost));
    await viewer.close();
  });

  it('is not named where it is the own one', LIMIT, async () => {
    const viewer = await Viewer.open(browser, `${own.url}/?ws=${own.url.replace('http', 'ws')}/ws`);
    await viewer.finished();
    assert.equal(await viewer.page.getByTestId('foreign-agent').count(), 0);
    await viewer.close();
  });

  it('is not followed where the operator of the page did not allow it, which is said', LIMIT, async () => {
    const text = await message(`${closed.url}/?ws=ws://${otherHost}/ws`, 'refused');
    assert.match(text, new RegExp(`does not let it follow ${otherHost.replaceAll('.', '\\.')}.*--allow-agent ws://${otherHost}`, 's'));
  });

  it('is not followed where its own operator did not allow the page, which is said', LIMIT, async () => {
    const from = await Agent.start({ args: ['--allow-agent', closed.url.replace('http', 'ws')] });
    try {
      const text = await message(`${from.url}/?ws=${closed.url.replace('http', 'ws')}/ws`, 'reconnecting');
      assert.ok(text.includes(`--allow-origin ${from.url}`), text);
    } finally {
      await from.stop();
    }
  });

  it('is named even where the address pretends to be the own one', LIMIT, async () => {
    const { host } = new URL(own.url);
    const page = await (await browser.newContext()).newPage();
    await page.goto(`${own.url}/?ws=ws://${host}@${otherHost}/ws`);
    assert.equal(await page.getByTestId('foreign-agent').getAttribute('data-host'), otherHost);
    await page.context().close();
  });

  /** What stands in place of the model once the connection is in this state. */
  async function message(url, state) {
    const page = await (await browser.newContext()).newPage();
    await page.goto(url);
    const found = page.locator(`[data-testid=viewport-message][data-state=${state}]`);
    await found.waitFor({ timeout: 60_000 });
    const text = await found.innerText();
    assert.ok(await page.getByTestId('foreign-agent').isVisible());
    await page.context().close();
    return text;
  }

  async function freePort() {
    const server = createServer().listen(0, '127.0.0.1');
    await once(server, 'listening');
    const { port } = server.address();
    server.close();
    await once(server, 'close');
    return port;
  }
});
