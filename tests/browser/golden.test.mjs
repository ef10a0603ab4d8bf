// Golden pictures: the same seed looks the same, pixel by pixel, on each backend.

import { after, before, it } from 'node:test';
import { assertGolden } from './support/golden.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** Enough of a page to see what is wrong, and small files. */
const SMALL = { width: 760, height: 420 };

onEveryBackend(
  'golden pictures',
  (session, backend) => {
    let viewer;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      await viewer.page.setViewportSize(SMALL);
      await viewer.finished();
    }, LIMIT);
    after(() => viewer?.close());

    for (const mode of ['appearance', 'component', 'confidence', 'views', 'defect', 'sigma']) {
      it(mode, LIMIT, async () => {
        await viewer.colorMode(mode);
        await assertGolden(await viewer.picture(), `${backend}-${mode}`);
      });
    }

    it('photo', LIMIT, async () => {
      await viewer.colorMode('photo');
      await viewer.page.locator('[data-testid=photo-key][data-state=ready]').waitFor({ timeout: 120_000 });
      await assertGolden(await viewer.picture(), `${backend}-photo`);
    });

    it('section', LIMIT, async () => {
      const { page } = viewer;
      await viewer.colorMode('component');
      await viewer.choose('show-mesh');
      await page.getByTestId('section').getByRole('switch', { name: /^Plane/ }).check();
      await page.locator('[data-testid=section][data-state=cut]').waitFor({ timeout: 120_000 });
      await assertGolden(await viewer.picture(), `${backend}-section`);
    });
  },
  { agent: {} },
);
