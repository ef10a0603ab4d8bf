// The model as a mesh: made in a worker, drawn, exported, and compared with a reference.

import assert from 'node:assert/strict';
import { after, before, it } from 'node:test';
import validator from 'gltf-validator';
import { Ply } from './support/ply.mjs';
import { semantics } from './support/semantics.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** What an element says of itself in its data attributes. */
const said = (viewer, id) => viewer.page.getByTestId(id).evaluate((element) => ({ ...element.dataset }));

onEveryBackend(
  'the surface',
  (session) => {
    let viewer, file;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      await viewer.finished();
    }, LIMIT);
    after(() => viewer?.close());

    it('is meshed when it is asked for, and drawn in place of the points', LIMIT, async () => {
      assert.equal((await said(viewer, 'mesh')).state, 'none');
      const points = await viewer.picture();
      await viewer.choose('show-mesh');
      await viewer.until((s) => Number(s.triangles) > 1000 && s.points === '0', null, 'the mesh in the picture');
      const mesh = await said(viewer, 'mesh');
      assert.equal(mesh.state, 'ready');
      assert.equal(mesh.outdated, 'false');
      const picture = await viewer.picture();
      assert.ok(!picture.equals(points), 'the picture is that of the points');
    });

    it('hides what the legend hides', LIMIT, async () => {
      const all = Number((await viewer.state()).triangles);
      await viewer.toggle(1);
      const some = Number((await viewer.state()).triangles);
      assert.ok(some > 0 && some < all, `${some} of ${all} triangles`);
      await viewer.toggle(1);
      assert.equal(Number((await viewer.state()).triangles), all);
    });

    it('is saved as a PLY with faces and as a GLB without an error by the Khronos validator', LIMIT, async () => {
      const estimated = async (kind) => Number(await viewer.page.getByTestId(`export-${kind}`).getAttribute('data-bytes'));
      file = await viewer.export('mesh-ply');
      const ply = new Ply(file.bytes);
      assert.ok(ply.count > 500, `${ply.count} vertices`);
      const header = file.bytes.subarray(0, 4000).toString('latin1');
      assert.equal(header.match(/element face (\d+)/)?.[1], (await said(viewer, 'mesh')).triangles);
      const glb = await viewer.export('mesh-glb');
      for (const [kind, { bytes }] of [['mesh-ply', file], ['mesh-glb', glb]]) {
        const said = await estimated(kind);
        assert.ok(Math.abs(said / bytes.length - 1) < 0.25, `${kind}: ${said} bytes said, ${bytes.length} written`);
      }
      const report = await validator.validateBytes(new Uint8Array(glb.bytes), { maxIssues: 50 });
      const errors = report.issues.messages.filter((message) => message.severity === 0);
      assert.equal(report.issues.numErrors, 0, JSON.stringify(errors, null, 2));
      assert.ok(report.info.totalTriangleCount >= Number((await said(viewer, 'mesh')).triangles));
      const { components } = await semantics(glb.bytes);
      const labels = new Set(ply.column('label'));
      assert.deepEqual(new Set(components.map((row) => row.id)), labels);
      // A vertex between two components is one of each.
      assert.ok(components.reduce((sum, row) => sum + row.vertices, 0) >= ply.count);
      assert.ok(components.every((row) => row.area > 0 && row.confidence > 0 && row.confidence <= 1));
    });

    it('is saved as fine, in the unit and in as many files as is chosen', LIMIT, async () => {
      const all = Number((await said(viewer, 'mesh')).triangles);
      await viewer.page.getByTestId('export-choice').locator('summary').click();
      await viewer.page.getByTestId('export-detail').selectOption('tenth');
      await viewer.page.getByTestId('export-unit').selectOption('inch');
      await viewer.page.getByTestId('export-up').selectOption('y');
      await viewer.page.getByTestId('export-solids').selectOption('one');
      const stl = await viewer.export('mesh-stl');
      const triangles = stl.bytes.readUInt32LE(80);
      assert.ok(triangles <= Math.ceil(all / 10) && triangles > all / 30, `${triangles} of ${all} triangles`);
      assert.equal(stl.bytes.length, 84 + 50 * triangles);
      assert.match(stl.bytes.subarray(0, 80).toString('latin1'), /unit inch, y up/);
      // A motor is some 150 mm high: along y, and counted in inches.
      const y = Array.from({ length: triangles }, (_, i) => stl.bytes.readFloatLE(84 + 50 * i + 12 + 4));
      const height = Math.max(...y) - Math.min(...y);
      assert.ok(height > 2 && height < 12, `${height} inches`);
      await viewer.page.getByTestId('export-detail').selectOption('full');
      await viewer.page.getByTestId('export-choice').locator('summary').click();
    });

    it('is compared with a reference: its own mesh, a millimetre higher, is a millimetre off', LIMIT, async () => {
      const reference = (dz) => {
        const bytes = Buffer.from(file.bytes);
        const ply = new Ply(file.bytes);
        const start = bytes.indexOf('end_header\n') + 'end_header\n'.length;
        for (let v = 0; v < ply.count; v += 1) {
          const at = start + v * ply.stride + 8;
          bytes.writeFloatLE(bytes.readFloatLE(at) + dz, at);
        }
        return { name: `moved-${dz}.ply`, mimeType: 'application/octet-stream', buffer: bytes };
      };
      const deviation = async (dz) => {
        await viewer.page.getByTestId('reference-file').setInputFiles(reference(dz));
        await viewer.page.getByTestId('reference').getByText(`moved-${dz}.ply`).waitFor();
        await viewer.page.locator('[data-testid=deviation][data-p95-mm]').waitFor();
        return said(viewer, 'deviation');
      };
      const none = await deviation(0);
      assert.ok(Number(none.p95Mm) < 0.01, JSON.stringify(none));
      const moved = await deviation(0.001);
      // No point is farther than the shift; walls along it are not off at all.
      assert.ok(Number(moved.p95Mm) > 0.5 && Number(moved.p95Mm) < 1.001, JSON.stringify(moved));
      assert.ok(Number(moved.rmsMm) > 0.2 && Number(moved.rmsMm) < 1, JSON.stringify(moved));
    });

    it('shows a signed scale that follows the tolerance', LIMIT, async () => {
      assert.ok(await viewer.page.getByTestId('color-mode-deviation').isChecked());
      const scale = viewer.page.getByTestId('color-scale');
      assert.match(await scale.innerText(), /\u22122\s*\u22120\.5\s*\+0\.5\s*\+2/);
      await viewer.redrawn(async () => {
        await viewer.page.getByTestId('tolerance').fill('0.1');
        await viewer.page.getByTestId('tolerance').press('Enter');
      });
      assert.match(await scale.innerText(), /\u22120\.4\s*\u22120\.1\s*\+0\.1\s*\+0\.4/);
      await viewer.page.getByTestId('reference-forget').click();
      await viewer.page.getByTestId('color-mode-deviation').waitFor({ state: 'detached' });
      assert.ok(await viewer.page.getByTestId('color-mode-component').isChecked());
    });

    it('is not painted by a reference in another unit or place: the page says so and offers the unit', LIMIT, async () => {
      const { page } = viewer;
      // The part's own mesh with other numbers: in another unit, in another place.
      const changed = (scale, shift) => {
        const bytes = Buffer.from(file.bytes);
        const ply = new Ply(file.bytes);
        const start = bytes.indexOf('end_header\n') + 'end_header\n'.length;
        for (let v = 0; v < ply.count; v += 1) {
          for (const axis of [0, 1, 2]) {
            const at = start + v * ply.stride + 4 * axis;
            bytes.writeFloatLE(bytes.readFloatLE(at) * scale + (axis === 0 ? shift : 0), at);
          }
        }
        return bytes;
      };
      const load = async (name, buffer) => {
        await page.getByTestId('reference-file').setInputFiles({ name, mimeType: 'application/octet-stream', buffer });
        await page.getByTestId('reference').getByText(name).waitFor();
        await page.locator('[data-testid=deviation][data-p95-mm]').waitFor();
      };
      await load('inches.ply', changed(1 / 0.0254, 0));
      const mismatch = page.getByTestId('reference-mismatch');
      await mismatch.waitFor();
      assert.match(await mismatch.innerText(), /times (as large|smaller).*In inch the two would be alike/s);
      assert.equal(await page.getByTestId('color-mode-deviation').isChecked(), false, 'painted all the same');
      await page.getByTestId('reference-unit-offer').click();
      await mismatch.waitFor({ state: 'detached' });
      assert.ok(await page.getByTestId('color-mode-deviation').isChecked());
      assert.equal(await page.getByTestId('reference-unit').inputValue(), 'inch');

      await load('elsewhere.ply', changed(1, 1));
      await mismatch.waitFor();
      assert.match(await mismatch.innerText(), /lies 1\.0 m away.*another frame.*--align/s);
      assert.equal(await page.getByTestId('color-mode-deviation').isChecked(), false);
      await page.getByTestId('reference-forget').click();
    });

    it('gives way to the points again', LIMIT, async () => {
      await viewer.choose('show-points');
      await viewer.until((s) => s.triangles === '0' && Number(s.points) > 0, null, 'the points in the picture');
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: {} },
);
