// An agent that sends without end: the page takes what fits into its memory, says that the rest is left out, and stays one
// that a person can use. Chunks of one point fill most for what is sent: 21 MB of them once filled 6.5 GB.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { readFile } from 'node:fs/promises';
import { describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { launch } from './support/chromium.mjs';
import { HostileLink } from './support/hostile.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** What makes the chunks; `cargo xtask test` builds it and says where it is. */
const ENDLESS = process.env.SEMASCAN_ENDLESS_STREAM;
/** Tags of field 16 of a message, a chunk, and of field 1 of that, its epoch (`shared/protocol/proto`). */
const [CHUNK, EPOCH] = [Buffer.from([0x82, 0x01]), 0x08];
/** Most that a process of the browser may grow by, bytes: the model, its copy on the way to the renderer, and the rest. */
const MOST = 1_600_000_000;
/** Chunks after the bound, which must take nothing. */
const AFTER = 5000;

describe('an agent that sends without end', { skip: ENDLESS ? false : 'SEMASCAN_ENDLESS_STREAM is not set' }, () => {
  for (const points of [1, 1200]) {
    it(`fills a page with chunks of ${points} points up to its bound, which the page says`, LIMIT, async (t) => {
      const agent = await Agent.start();
      const browser = await launch('webgl2');
      const sender = new Sender(points);
      const link = await HostileLink.to(agent.port, (message, send) => sender.follow(message, send));
      try {
        // A first page, so that the browser itself is warm.
        const honest = await Viewer.open(browser, agent.url);
        await honest.finished();
        await honest.close();
        const before = await peakMemory(browser);

        const viewer = await Viewer.open(browser, link.url);
        const notice = viewer.page.getByTestId('banner').filter({ hasText: 'larger than a browser page can hold' });
        await notice.waitFor({ timeout: 300_000 });
        const upTo = sender.chunks + AFTER;
        while (sender.chunks < upTo) await viewer.page.waitForTimeout(100);
        const [grown, state] = [(await peakMemory(browser)) - before, await viewer.state()];
        t.diagnostic(
          `${sender.chunks} chunks in ${megabytes(sender.bytes)} MB sent, ${state.points} points held, ${megabytes(grown)} MB more`,
        );
        assert.ok(grown < MOST, `${grown} bytes more`);
        assert.equal(state.connection, 'connected');
        await viewer.close();
      } finally {
        sender.stop();
        await browser.close();
        await link.close();
        await agent.stop();
      }
    });
  }
});

/** Sends chunks of so many points once the agent has sent its first one. */
class Sender {
  chunks = 0;
  bytes = 0;
  #points;
  #child;

  constructor(points) {
    this.#points = points;
  }

  async follow(message, send) {
    if (this.#child || !message.subarray(0, 2).equals(CHUNK)) return;
    this.#child = spawn(ENDLESS, [String(epoch(message)), String(this.#points), '0.001'], { stdio: ['ignore', 'pipe', 'inherit'] });
    let held = Buffer.alloc(0);
    for await (const bytes of this.#child.stdout) {
      held = Buffer.concat([held, bytes]);
      while (held.length >= 4 && held.length >= 4 + held.readUInt32LE()) {
        const end = 4 + held.readUInt32LE();
        await send(held.subarray(4, end));
        [this.chunks, this.bytes] = [this.chunks + 1, this.bytes + end];
        held = held.subarray(end);
      }
    }
  }

  stop() {
    this.#child?.kill('SIGKILL');
  }
}

/** The epoch of a chunk: the first field of the message in the message. */
function epoch(message) {
  let at = CHUNK.length;
  while (message[at++] & 0x80);
  assert.equal(message[at], EPOCH, 'a chunk begins with its epoch');
  return message[at + 1];
}

/** Most memory that any process of the browser has had resident, bytes. */
async function peakMemory(browser) {
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send('SystemInfo.getProcessInfo');
  await session.detach();
  const peaks = processInfo.map(async ({ id }) => {
    const status = await readFile(`/proc/${id}/status`, 'utf8').catch(() => '');
    return 1024 * Number(status.match(/VmHWM:\s+(\d+)/)?.[1] ?? 0);
  });
  return Math.max(...(await Promise.all(peaks)));
}

function megabytes(bytes) {
  return Math.round(bytes / 1e6);
}
