// The agent stands on a person's machine, within reach of every web page that they open: none but its own may open
// the live stream.

import assert from 'node:assert/strict';
import { createServer } from 'node:http';
import { once } from 'node:events';
import { after, before, describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { launch, newPage } from './support/chromium.mjs';
import { Link } from './support/link.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

describe('the origin of a page', () => {
  let agent, browser, stranger, socketPath;

  before(async () => {
    agent = await Agent.start();
    browser = await launch('webgl2');
    stranger = createServer((_, answer) => answer.setHeader('content-type', 'text/html').end('<!doctype html>'));
    stranger.listen(0, '127.0.0.1');
    await once(stranger, 'listening');

    // Where the socket is, the viewer knows: the path it asks for is seen on the wire.
    const link = await Link.to(agent.port);
    const viewer = await Viewer.open(browser, link.url);
    await viewer.until((s) => s.connection === 'connected', null, 'the connection', 60_000);
    socketPath = link.sockets[0].socket;
    await viewer.close();
    await link.close();
  }, LIMIT);

  after(async () => {
    await browser?.close();
    stranger?.close();
    await agent?.stop();
  }, LIMIT);

  it('may be the agent itself', LIMIT, async () => {
    assert.equal(await opens(agent.url), 'open');
  });

  it('may not be another port of the same machine', LIMIT, async () => {
    assert.equal(await opens(`http://127.0.0.1:${stranger.address().port}`), 'refused');
  });

  it('may not be another name of the same machine', LIMIT, async () => {
    assert.equal(await opens(`http://localhost:${stranger.address().port}`), 'refused');
  });

  /** What becomes of a socket to the agent that a page of `origin` opens. */
  async function opens(origin) {
    const page = await newPage(browser);
    await page.goto(origin);
    const outcome = await page.evaluate((url) => {
      return new Promise((resolve) => {
        const socket = new WebSocket(url, 'semascan.v1');
        socket.onopen = () => resolve('open');
        socket.onerror = () => resolve('refused');
      });
    }, `ws://127.0.0.1:${agent.port}${socketPath}`);
    await page.context().close();
    return outcome;
  }
});
