// What networks say of a view, over its picture: classes, uncertainty, and which stream of a two-stream network spoke (P2).

import assert from 'node:assert/strict';
import { after, before, it } from 'node:test';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const SOURCE = 'virtual:starter-motor?seed=1003&views=2&size=320x240&errors=none';

/** Size of an image of the card and how many of its pixels are not transparent, as the browser decoded it. */
const decoded = (locator) =>
  locator.evaluate(async (image) => {
    await image.decode();
    const { naturalWidth: width, naturalHeight: height } = image;
    const context = new OffscreenCanvas(width, height).getContext('2d');
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, width, height);
    let visible = 0;
    const colours = new Set();
    for (let i = 0; i < data.length; i += 4) {
      if (data[i + 3] === 0) continue;
      visible++;
      colours.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
    }
    return { width, height, visible, colours: colours.size };
  });

onEveryBackend(
  'the overlays of a view',
  (session) => {
    let viewer, card;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      await viewer.finished();
      await viewer.page.getByTestId('view-0').click();
      card = viewer.page.getByTestId('view-detail');
    }, LIMIT);
    after(() => viewer?.close());

    it('are offered as far as the network gives them', LIMIT, async () => {
      const offered = await card.locator('input[name=overlay]').evaluateAll((inputs) => inputs.map((i) => i.value));
      assert.deepEqual(offered, ['none', 'labels', 'sigma', 'contribution']);
      const [needed, there] = await card.evaluate((element) => [element.scrollWidth, element.clientWidth]);
      assert.ok(needed <= there, `the card needs ${needed} pixels and has ${there}`);
    });

    it('lie on the picture, pixel on pixel, and each shows something else', LIMIT, async () => {
      const photo = await decoded(card.locator('.picture-photo'));
      const sources = new Set();
      for (const kind of ['labels', 'sigma', 'contribution']) {
        await viewer.choose(`overlay-${kind}`);
        const overlay = card.locator('.picture-overlay');
        sources.add(await overlay.getAttribute('src'));
        const shown = await decoded(overlay);
        assert.deepEqual([shown.width, shown.height], [photo.width, photo.height], kind);
        assert.ok(shown.visible > 0.01 * photo.width * photo.height, `${kind}: ${shown.visible} pixels`);
        assert.ok(shown.colours >= 3, `${kind}: ${shown.colours} colours`);
      }
      assert.equal(sources.size, 3);
      await viewer.choose('overlay-none');
      await card.locator('.picture-overlay').waitFor({ state: 'detached' });
    });

    it('log no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: { source: SOURCE, models: 'two-stream-edge' } },
);
