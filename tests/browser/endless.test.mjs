// An agent that sends without end: the page takes what fits into its memory, says that the rest is left out, and stays one
// that a person can use. Chunks of one point fill most for what is sent: 21 MB of them once filled 6.5 GB.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { launch, newPage } from './support/chromium.mjs';
import { HostileLink } from './support/hostile.mjs';
import { ENDLESS, Sender } from './support/sender.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/**
 * What is sent to which device, and the most that a process of the browser may grow by there, bytes: the model, its copy on the way
 * to the renderer, and the rest. Chunks of many points are held thinner first.
 */
const CASES = [
  { points: 1, gigabytes: 6, most: 1_600_000_000 },
  { points: 1200, gigabytes: 2, most: 400_000_000, thinned: /every \d+th point is shown/ },
];
/** Chunks after the bound, which must take nothing. */
const AFTER = 5000;

describe('an agent that sends without end', { skip: ENDLESS ? false : 'SEMASCAN_ENDLESS_STREAM is not set' }, () => {
  for (const { points, gigabytes, most, thinned } of CASES) {
    it(`fills a page with chunks of ${points} points up to the bound of ${gigabytes} GB, which it says`, LIMIT, async (t) => {
      const agent = await Agent.start();
      const browser = await launch('webgl2');
      const sender = new Sender({ points });
      const link = await HostileLink.to(agent.port, (message, send) => sender.follow(message, send));
      try {
        // A first page, so that the browser itself is warm.
        const honest = await Viewer.open(browser, agent.url);
        await honest.finished();
        await honest.close();
        const before = await peakMemory(browser);

        const viewer = new Viewer(await newPage(browser));
        await viewer.page.addInitScript((value) => Object.defineProperty(navigator, 'deviceMemory', { value }), gigabytes);
        await viewer.page.goto(link.url);
        const banner = viewer.page.getByTestId('banner');
        if (thinned) await banner.filter({ hasText: thinned }).waitFor({ timeout: 300_000 });
        const notice = banner.filter({ hasText: 'larger than a browser page can hold' });
        await notice.waitFor({ timeout: 300_000 });
        const upTo = sender.chunks + AFTER;
        while (sender.chunks < upTo) await viewer.page.waitForTimeout(100);
        const [grown, state] = [(await peakMemory(browser)) - before, await viewer.state()];
        t.diagnostic(
          `${sender.chunks} chunks in ${megabytes(sender.bytes)} MB sent, ${state.points} points held, ${megabytes(grown)} MB more`,
        );
        assert.ok(grown < most, `${grown} bytes more`);
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
