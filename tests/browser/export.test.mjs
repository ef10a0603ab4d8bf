// What a person downloads is what is shown, and other programs read it.

import assert from 'node:assert/strict';
import { after, before, describe, it } from 'node:test';
import validator from 'gltf-validator';
import { Ply } from './support/ply.mjs';
import { semantics } from './support/semantics.mjs';
import { BACKENDS } from './support/chromium.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** Columns of `cloud.ply`, in order. */
const COLUMNS =
  'x y z nx ny nz red green blue label confidence defect defect_confidence sigma defect_sigma instance views flags';

onEveryBackend(
  'exports',
  (session, backend) => {
    let viewer, points;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      await viewer.finished();
      points = (await viewer.points()).reduce((sum, count) => sum + count, 0);
    }, LIMIT);
    after(() => viewer?.close());

    it('a PLY with every property of every point', LIMIT, async () => {
      const file = await viewer.export('ply');
      assert.match(file.name, /\.ply$/);
      const ply = new Ply(file.bytes);
      assert.equal(ply.properties.map((property) => property.name).join(' '), COLUMNS);
      assert.equal(ply.body.length, ply.count * ply.stride, 'as many bytes as the header announces');
      assert.equal(ply.count, points, 'as many points as the viewer holds');

      const known = new Set([0, ...ply.classes.map((one) => one.id)]);
      const labels = new Set(ply.column('label'));
      assert.ok([...labels].every((label) => known.has(label)), `labels ${[...labels]} of classes ${[...known]}`);
      assert.ok(labels.size >= 3, 'several components');
      assert.ok(ply.column('confidence').every((share) => share >= 0 && share <= 1));
      for (const axis of ['x', 'y', 'z']) {
        const size = Math.max(...extent(ply.column(axis)).map(Math.abs));
        assert.ok(size > 0.005 && size < 1, `${axis} reaches ${size} m`);
      }
    });

    it('a GLB without an error by the Khronos validator, with a node for each component', LIMIT, async () => {
      const file = await viewer.export('glb');
      assert.match(file.name, /\.glb$/);
      const report = await validator.validateBytes(new Uint8Array(file.bytes), { maxIssues: 50 });
      const errors = report.issues.messages.filter((message) => message.severity === 0);
      assert.equal(report.issues.numErrors, 0, JSON.stringify(errors, null, 2));

      const gltf = glbJson(file.bytes);
      const { classes } = new Ply((await viewer.export('ply')).bytes);
      const nodes = gltf.nodes.map((node) => node.name ?? '');
      const named = classes.filter((one) => nodes.some((name) => name.includes(one.name)));
      assert.ok(named.length >= 3, `nodes ${nodes.join(', ')} for ${classes.map((one) => one.name).join(', ')}`);
    });

    it('a GLB whose points tell another reader what they belong to', LIMIT, async () => {
      const { components } = await semantics((await viewer.export('glb')).bytes);
      const ply = new Ply((await viewer.export('ply')).bytes);
      const points = new Map();
      for (const label of ply.column('label')) points.set(label, (points.get(label) ?? 0) + 1);
      assert.deepEqual(new Map(components.map((row) => [row.id, row.vertices])), new Map([...points].sort()));
      for (const { id, name, color } of ply.classes.filter((one) => points.has(one.id))) {
        const row = components.find((one) => one.id === id);
        assert.deepEqual([row.name, row.color], [name, color]);
      }
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());

    // What workers do is the same whatever draws.
    if (backend === BACKENDS[0]) exportsBesideThePage(session);
  },
  { agent: {} },
);

/** An export that takes long: the page goes on meanwhile, and it can be ended. */
function exportsBesideThePage(session) {
  describe('beside the page', () => {
    let viewer, page;
    const downloads = [];
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      page.on('download', (download) => downloads.push(download));
      await page.getByTestId('open-file').setInputFiles({ name: 'waves.ply', mimeType: 'application/octet-stream', buffer: waves(400) });
      await page.locator('[data-testid=mesh][data-state=ready]').waitFor({ timeout: 120_000 });
      await page.getByTestId('export-choice').locator('summary').click();
    }, LIMIT);
    after(() => viewer?.close());

    const running = () => page.getByTestId('export-progress');
    const detail = (key) => page.getByTestId('export-detail').selectOption(key);

    it('is taken from there, and the picture follows a person meanwhile', LIMIT, async () => {
      await detail('tenth');
      await page.getByTestId('export-mesh-stl').click();
      await page.waitForFunction(() => document.querySelector('[data-testid=export-progress]')?.value > 0, null, { timeout: 120_000 });
      assert.equal(await page.getByTestId('export-mesh-ply').isDisabled(), true, 'one export at a time');
      const before = Number((await viewer.state()).frames);
      await viewer.canvas.press('ArrowLeft');
      await viewer.until((s, before) => Number(s.frames) > before, before, 'a frame during the export', 60_000);
      assert.equal(await running().count(), 1, 'the export was over before the picture moved');
    });

    it('leaves nothing behind when it is cancelled', LIMIT, async () => {
      await page.getByTestId('export-cancel').click();
      await running().waitFor({ state: 'detached' });
      await page.getByText('nothing was saved').first().waitFor();
      await detail('full');
      const file = await viewer.export('mesh-stl');
      assert.equal(downloads.length, 1, 'the cancelled export was saved');
      assert.equal(file.bytes.length, 84 + 50 * file.bytes.readUInt32LE(80));
      assert.equal(file.bytes.readUInt32LE(80), 2 * 399 * 399);
      const again = await viewer.export('mesh-stl');
      assert.ok(again.bytes.equals(file.bytes), 'another file than the first time');
    });

    it('is as large as the panel says', LIMIT, async () => {
      for (const kind of ['mesh-ply', 'mesh-glb', 'mesh-stl', 'ply']) {
        const said = Number(await page.getByTestId(`export-${kind}`).getAttribute('data-bytes'));
        const { length } = (await viewer.export(kind)).bytes;
        assert.ok(Math.abs(said / length - 1) < 0.25, `${kind}: ${said} said, ${length} written`);
      }
      viewer.assertNoErrors();
    });

    it('is saved even where the worker does not load', LIMIT, async () => {
      const usual = (await viewer.export('mesh-stl')).bytes;
      await page.route('**/export_worker.js', (route) => route.abort());
      const { bytes } = await viewer.export('mesh-stl');
      assert.ok(bytes.equals(usual));
      await page.unroute('**/export_worker.js');
    });
  });
}

/** A PLY of a wavy sheet of `n` x `n` vertices. */
function waves(n) {
  const triangles = 2 * (n - 1) * (n - 1);
  const head = `ply\nformat binary_little_endian 1.0\nelement vertex ${n * n}\nproperty float x\nproperty float y\nproperty float z\n`
    + `element face ${triangles}\nproperty list uchar int vertex_indices\nend_header\n`;
  const body = Buffer.alloc(12 * n * n + 13 * triangles);
  let at = 0;
  for (let k = 0; k < n * n; k += 1) {
    const [x, y] = [(k % n) / n, Math.floor(k / n) / n];
    for (const value of [x, y, 0.05 * Math.sin(20 * x) * Math.cos(17 * y)]) at = body.writeFloatLE(0.2 * value, at);
  }
  for (let k = 0; k < (n - 1) * (n - 1); k += 1) {
    const a = k + Math.floor(k / (n - 1));
    for (const corners of [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]) {
      at = body.writeUInt8(3, at);
      for (const corner of corners) at = body.writeInt32LE(corner, at);
    }
  }
  return Buffer.concat([Buffer.from(head), body]);
}

function extent(values) {
  return values.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
}

/** The JSON chunk of a binary glTF file (glTF 2.0, section 4.4). */
function glbJson(bytes) {
  assert.equal(bytes.subarray(0, 4).toString(), 'glTF');
  assert.equal(bytes.subarray(16, 20).toString(), 'JSON');
  return JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString('utf8'));
}
