// One number for one thing: the legend, the record of the inspection and the scenes say the same.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, it } from 'node:test';
import { BINARY, SOURCE } from './support/agent.mjs';
import { semantics } from './support/semantics.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

onEveryBackend(
  'figures',
  (session) => {
    let viewer, folder, record;
    before(async () => {
      // The source is the same to the last bit, and so is the inspection.
      folder = mkdtempSync(join(tmpdir(), 'semascan-figures-'));
      const run = spawnSync(BINARY, ['inspect', SOURCE, '--out', join(folder, 'motor')], { encoding: 'utf8' });
      assert.equal(run.status, 0, run.stderr);
      record = JSON.parse(readFileSync(join(folder, 'motor', 'inspection.json'), 'utf8'));
      viewer = await Viewer.open(session.browser, session.agent.url);
      await viewer.finished();
    }, LIMIT);
    after(async () => {
      await viewer?.close();
      rmSync(folder, { recursive: true, force: true });
    });

    /** Points, area in tenths of a square millimetre and confidence of each component of the record. */
    const stated = () =>
      record.components.map((c) => [c.class, c.points, (c.area * 1e6).toFixed(1), c.confidence.toFixed(3)]);

    it('of the legend are those of the record', LIMIT, async () => {
      const rows = viewer.page.locator('[data-testid^=legend-row-]');
      await rows.first().and(viewer.page.locator('[data-area-mm2]')).waitFor();
      const shown = await rows.evaluateAll((all) =>
        all.map(({ dataset: d }) => [Number(d.testid.split('-').pop()), Number(d.points), d.areaMm2, d.confidence]),
      );
      assert.deepEqual(shown.sort((a, b) => a[0] - b[0]), stated());
      assert.ok(stated().filter(([, , area]) => Number(area) > 100).length >= 3, 'several components have an area');
    });

    it('of exported points and meshes are those of the record', LIMIT, async () => {
      const check = async (id) => {
        const { components, defects } = await semantics((await viewer.export(id)).bytes);
        assert.ok(components.length >= 3);
        const of = (list, row) => list.find((one) => one.class === row.id);
        for (const row of [...components, ...(defects ?? []).filter((row) => row.id !== 0)]) {
          const one = of(components.includes(row) ? record.components : record.defects, row);
          assert.equal(row.points, one.points, `points of ${row.name} in ${id}`);
          assert.equal(row.area, Math.fround(one.area), `area of ${row.name} in ${id}`);
          assert.equal(row.confidence, Math.fround(one.confidence), `confidence of ${row.name} in ${id}`);
        }
      };
      await check('glb');
      await viewer.choose('show-mesh');
      await viewer.until((s) => Number(s.triangles) > 1000, null, 'the mesh');
      await check('mesh-glb');
    });

    it('are the same when the mesh was made in the page', LIMIT, async () => {
      const row = viewer.page.getByTestId('legend-row-1');
      const area = stated().find(([id]) => id === 1)[2];
      assert.equal(await row.getAttribute('data-area-mm2'), area);
    });

    it('say what an export leaves out', LIMIT, async () => {
      const note = viewer.page.getByTestId('export-note');
      await viewer.toggle(1);
      const [points, held] = await note.evaluate(({ dataset }) => [Number(dataset.points), Number(dataset.held)]);
      assert.equal(held, record.points, 'the model has all points of the record');
      assert.ok(points > 0 && points < held, `${points} of ${held}`);
      assert.match(await note.textContent(), /of the model's .* points\. Left out are/);
      await viewer.toggle(1);
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: {} },
);
