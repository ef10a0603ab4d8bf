// A puck with six axes moves the camera: a device of the test's own that sends the reports which 3Dconnexion's devices send.

import assert from 'node:assert/strict';
import { after, before, it } from 'node:test';
import { newPage } from './support/chromium.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** Runs in the page before its scripts: the one device that there is, at first unknown to the page. */
function device() {
  const puck = Object.assign(new EventTarget(), {
    vendorId: 0x256f,
    productId: 0xc635,
    productName: 'SpaceMouse Compact',
    opened: false,
    collections: [{ usagePage: 1, usage: 8 }],
    open: async () => (puck.opened = true),
  });
  const hid = Object.assign(new EventTarget(), {
    getDevices: async () => [],
    requestDevice: async ({ filters }) => {
      window.askedFor = filters;
      return [puck];
    },
  });
  Object.defineProperty(navigator, 'hid', { value: hid });
  window.puck = {
    report(reportId, values) {
      const data = new DataView(new ArrayBuffer(values.length * 2));
      values.forEach((value, k) => data.setInt16(2 * k, value, true));
      puck.dispatchEvent(Object.assign(new Event('inputreport'), { reportId, data }));
    },
    unplug: () => hid.dispatchEvent(Object.assign(new Event('disconnect'), { device: puck })),
  };
}

onEveryBackend(
  'a SpaceMouse',
  (session) => {
    let viewer, page;
    before(async () => {
      page = await newPage(session.browser);
      await page.addInitScript(device);
      viewer = new Viewer(page);
      await page.goto(session.agent.url);
      await viewer.finished();
    }, LIMIT);
    after(() => viewer?.close());

    const report = (id, values) => page.evaluate(([id, values]) => window.puck.report(id, values), [id, values]);

    /** Holds the puck for a moment, lets it go, and gives the picture before and after. */
    const hold = async (id, values) => {
      const before = await viewer.picture();
      await viewer.redrawn(async () => {
        await report(id, values);
        await page.waitForTimeout(400);
        await report(id, values.map(() => 0));
      });
      return [before, await viewer.picture()];
    };

    it('is connected from the palette', LIMIT, async () => {
      assert.ok(await page.evaluate(() => document.featurePolicy.allowsFeature('hid')), 'the agent forbids it');
      await page.keyboard.press('Control+k');
      await page.keyboard.type('spacemouse');
      await page.keyboard.press('Enter');
      await page.getByText('SpaceMouse Compact moves the camera').waitFor();
      const asked = await page.evaluate(() => window.askedFor);
      assert.ok(asked.some(({ vendorId, usagePage, usage }) => vendorId === 0x256f && usagePage === 1 && usage === 8));
    });

    it('moves and turns the model while it is held, and no longer', LIMIT, async () => {
      const [before, moved] = await hold(1, [350, 0, 0]);
      assert.ok(moved.difference(before) > 0.02, `${moved.difference(before)} of the picture`);
      // Let go, it rests: what else of the page may be drawn anew, the camera stays where it is.
      await page.waitForTimeout(500);
      assert.equal((await viewer.picture()).difference(moved), 0);
      const [still, turned] = await hold(2, [0, 0, -350]);
      assert.ok(turned.difference(still) > 0.02, `${turned.difference(still)} of the picture`);
      // Devices of today send all six axes at once.
      const [rest, nearer] = await hold(1, [0, 350, 0, 0, 0, 0]);
      assert.ok(nearer.drawn() > rest.drawn(), `${rest.drawn()} pixels, then ${nearer.drawn()}`);
    });

    it('shows the whole model by its button', LIMIT, async () => {
      const away = await viewer.picture();
      await viewer.redrawn(() => report(3, [1]));
      assert.ok((await viewer.picture()).difference(away) > 0.01);
      await report(3, [0]);
    });

    it('that is unplugged in the hand stops', LIMIT, async () => {
      await viewer.redrawn(() => report(1, [200, 0, 0]));
      await page.evaluate(() => window.puck.unplug());
      await page.getByText('The SpaceMouse is gone').waitFor();
      await viewer.picture();
      viewer.assertNoErrors();
    });
  },
  { agent: {} },
);
