// Photographs as evidence: the pixel that is marked is the pixel of the picked point, and a photograph on the mesh colours what its
// camera saw and nothing else.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, it } from 'node:test';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

onEveryBackend(
  'photographs',
  (session, backend) => {
    let viewer, page, card;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      card = page.getByTestId('evidence');
      await viewer.finished();
      await viewer.colorMode('appearance');
    }, LIMIT);
    after(() => viewer?.close());

    /** Clicks where the model is drawn, until a point is picked that photographs show. */
    const pick = async (skip = 0) => {
      await viewer.colorMode('component');
      const picture = await viewer.picture();
      const box = await viewer.canvas.boundingBox();
      let found = 0;
      for (const { x, y } of picture.insides([[78, 121, 167], [242, 142, 43], [225, 87, 89], [118, 183, 178], [89, 161, 79], [237, 201, 72]], 4)) {
        if (y < 70) continue;
        await page.mouse.click(box.x + x, box.y + y);
        const offer = page.getByTestId('evidence-open').or(card);
        await offer.waitFor({ timeout: 20_000 });
        if ((await card.count()) || (await page.getByTestId('evidence-open').isEnabled())) {
          if (found++ === skip) return { x, y };
        }
      }
      throw new Error('no photograph shows any point');
    };

    /** The photograph that is shown: its view, the marked pixel, once its pixels are there. */
    const shown = async () => {
      await page.waitForFunction(() => document.querySelector('[data-testid=evidence-picture]')?.dataset.full !== undefined, null, { timeout: 20_000 });
      const { view, u, v, full } = await page.getByTestId('evidence-picture').evaluate((element) => ({ ...element.dataset }));
      return { view: Number(view), u: Number(u), v: Number(v), full };
    };

    /** What the agent's record and depth picture say of a pixel: its place in the table frame, millimetres. */
    const placeOf = ({ view, u, v }) =>
      page.evaluate(
        async ({ view, u, v }) => {
          const id = document.getElementById('viewport').dataset.inspection;
          const list = await (await fetch(`/api/v1/inspections/${id}/views`)).json();
          const { rotation: q, translation: t } = list.items.find((item) => item.index === view).pose;
          const answer = await fetch(`/api/v1/inspections/${id}/views/${view}/depth.png`);
          const unit = Number(answer.headers.get('depth-unit-metres'));
          // A canvas has 8 bits: the low and the high byte are not told apart there, so the file itself is read.
          const bytes = new Uint8Array(await answer.arrayBuffer());
          return { q, t, unit, bytes: Array.from(bytes), u, v };
        },
        { view, u, v },
      );

    it('offers the photographs of a picked point, the best first, and marks its pixel', LIMIT, async () => {
      await pick();
      await page.keyboard.press('e');
      await card.waitFor();
      const { PNG } = createRequire(import.meta.url)('pngjs');
      const seen = [];
      const count = Number((await card.locator('h2').innerText()).match(/of (\d+)/)[1]);
      const picked = await page.getByTestId('inspect-card').evaluate((c) => ['xMm', 'yMm', 'zMm'].map((k) => Number(c.dataset[k])));
      for (let i = 0; i < count; i++) {
        const photograph = await shown();
        assert.equal(photograph.full, 'true', 'the demo keeps pictures in full size');
        const density = Number((await card.locator('.detail-figures').innerText()).match(/Pixels per mm\s+([\d.]+)/)[1]);
        seen.push({ ...photograph, density });
        const { q, t, unit, bytes, u, v } = await placeOf(photograph);
        const depth = PNG.sync.read(Buffer.from(bytes), { skipRescale: true });
        const at = Math.round(v) * depth.width + Math.round(u);
        const z = depth.data[4 * at] * unit;
        assert.ok(z > 0, 'the view measured depth at the marked pixel');
        // The picked point lies at that depth in the camera's frame: |point - eye| and the depth agree within a few voxels.
        const eye = [t[0], t[1], t[2]].map((c) => c * 1e3);
        const forward = rotated(q, [0, 0, 1]);
        const along = picked.reduce((sum, c, k) => sum + (c - eye[k]) * forward[k], 0);
        assert.ok(Math.abs(along - z * 1e3) < 8, `view ${photograph.view}: the point lies ${along.toFixed(1)} mm ahead, the depth is ${(z * 1e3).toFixed(1)} mm`);
        await page.keyboard.press('.');
        if (count > 1) await page.waitForFunction((before) => document.querySelector('[data-testid=evidence-picture]')?.dataset.view !== before, String(photograph.view));
      }
      assert.equal(new Set(seen.map((s) => s.view)).size, count, 'each view once, and round to the first');
      const densities = seen.map((s) => s.density);
      assert.deepEqual(densities, [...densities].sort((a, b) => b - a), 'the best first');
    });

    it('lays a photograph onto the mesh where its camera saw it, and nowhere else', LIMIT, async () => {
      await page.keyboard.press('Escape');
      await page.keyboard.press('Escape');
      await pick();
      await page.keyboard.press('e');
      await shown();
      await page.getByTestId('evidence-project').click();
      await viewer.until((s) => Number(s.triangles) > 0, null, 'the mesh', 60_000);
      await viewer.colorMode('component');
      await page.getByTestId('evidence-look').click();
      const strength = async (value) => {
        await page.getByTestId('evidence-strength').fill(String(value));
        return viewer.picture();
      };
      const full = await strength(1);
      const none = await strength(0);
      const seen = full.difference(none);
      assert.ok(seen > 0.02, `from the camera ${(100 * seen).toFixed(2)} % of the picture is the photograph`);
      // Component colours are full, the cell's metal is grey.
      assert.ok(full.coloured() < 0.7 * none.coloured(), `${full.coloured()} coloured pixels of ${none.coloured()}`);
      // From behind only what both sides see of it: the top.
      const box = await viewer.canvas.boundingBox();
      const half = box.height;
      await page.mouse.move(box.x + 120, box.y + box.height - 30);
      await page.mouse.down();
      await page.mouse.move(box.x + 120 + half, box.y + box.height - 30, { steps: 6 });
      await page.mouse.up();
      const behind = (await strength(1)).difference(await strength(0));
      assert.ok(behind < 0.4 * seen, `from behind ${(100 * behind).toFixed(2)} % of the picture changes, from the camera ${(100 * seen).toFixed(2)} %`);
      await page.getByTestId('evidence-close').click();
      await page.getByTestId('evidence-open').waitFor();
    });

    it('is reached by keyboard, and names what it shows', LIMIT, async () => {
      await page.keyboard.press('e');
      await card.waitFor();
      await page.evaluate(await readFile(AXE, 'utf8'));
      const { violations } = await page.evaluate(() => globalThis.axe.run({ include: [['[data-testid=evidence]']] }, { runOnly: ['wcag2a', 'wcag2aa'] }));
      assert.deepEqual(violations.map((v) => `${v.id}: ${v.help}`), []);
      await page.getByTestId('evidence-close').focus();
      const first = (await shown()).view;
      await page.keyboard.press('ArrowRight');
      await page.waitForFunction((first) => document.querySelector('[data-testid=evidence-picture]')?.dataset.view !== first, String(first));
      await page.keyboard.press('ArrowLeft');
      await page.waitForFunction((first) => document.querySelector('[data-testid=evidence-picture]')?.dataset.view === first, String(first));
      await page.keyboard.press('Escape');
      await page.getByTestId('evidence-open').waitFor();
      viewer.assertNoErrors();
    });
  },
  { agent: {} },
);

/** A vector turned by a unit quaternion. */
function rotated({ x, y, z, w }, [a, b, c]) {
  const cross = (p, q) => [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
  const axis = [x, y, z];
  const once = cross(axis, [a, b, c]).map((v) => 2 * v);
  const twice = cross(axis, once);
  return [a, b, c].map((v, k) => v + w * once[k] + twice[k]);
}
