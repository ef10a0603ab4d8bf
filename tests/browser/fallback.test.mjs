// Which graphics interface is used, and what is left of the viewer where there is none.

import assert from 'node:assert/strict';
import { after, before, describe, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { launch } from './support/chromium.mjs';
import { Ply } from './support/ply.mjs';
import { LIMIT } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

describe('graphics', () => {
  let agent;
  before(async () => {
    agent = await Agent.start();
  }, LIMIT);
  after(() => agent?.stop(), LIMIT);

  it('can be chosen in the address', LIMIT, async () => {
    await withViewer('webgpu', '/?renderer=webgl2', async (viewer) => {
      assert.equal(await backend(viewer), 'webgl2');
      await viewer.finished();
      assert.ok((await viewer.picture()).coloured() > 500, 'nothing was drawn');
    });
  });

  it('fall back where the better one is missing', LIMIT, async () => {
    await withViewer('webgl2', '/', async (viewer) => {
      assert.equal(await backend(viewer), 'webgl2');
    });
  });

  it('may be missing: the page says so, and figures and exports keep working', LIMIT, async () => {
    await withViewer('none', '/', async (viewer) => {
      const { page } = viewer;
      const message = page.getByTestId('viewport-message');
      await message.waitFor({ state: 'visible', timeout: 60_000 });
      assert.equal(await message.getAttribute('data-state'), 'gpu');
      const text = await message.innerText();
      assert.match(text, /hardware/i, 'what helps is not said');
      assert.doesNotMatch(text, /webgl2|webgpu|Error|[{}]|::/, 'what a program says is no text for people');
      await viewer.until((s) => s.phase === 'finished', null, 'the end of the inspection');
      const ply = new Ply((await viewer.export('ply')).bytes);
      assert.ok(ply.count > 1000, `${ply.count} points`);
    });
  });

  /** The interface that the viewer ended up with. */
  async function backend(viewer) {
    return (await viewer.until((s) => Number(s.frames) > 0, null, 'the first frame')).backend;
  }

  async function withViewer(flags, path, test) {
    const browser = await launch(flags);
    try {
      await test(await Viewer.open(browser, agent.url + path));
    } finally {
      await browser.close();
    }
  }
});
