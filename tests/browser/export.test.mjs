// What a person downloads is what is shown, and other programs read it.

import assert from 'node:assert/strict';
import { after, before, it } from 'node:test';
import validator from 'gltf-validator';
import { Ply } from './support/ply.mjs';
import { semantics } from './support/semantics.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** Columns of `cloud.ply`, in order. */
const COLUMNS =
  'x y z nx ny nz red green blue label confidence defect defect_confidence sigma defect_sigma instance views flags';

onEveryBackend(
  'exports',
  (session) => {
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
  },
  { agent: {} },
);

function extent(values) {
  return values.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
}

/** The JSON chunk of a binary glTF file (glTF 2.0, section 4.4). */
function glbJson(bytes) {
  assert.equal(bytes.subarray(0, 4).toString(), 'glTF');
  assert.equal(bytes.subarray(16, 20).toString(), 'JSON');
  return JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString('utf8'));
}
