// A mesh with its photographs as a texture, as the agent writes it: other programs read it.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, it } from 'node:test';
import validator from 'gltf-validator';
import { BINARY, SOURCE } from './support/agent.mjs';
import { semantics } from './support/semantics.mjs';
import { LIMIT } from './support/session.mjs';

describe('a textured GLB', () => {
  const folder = mkdtempSync(join(tmpdir(), 'semascan-texture-'));
  let bytes;
  before(() => {
    const run = (...args) => execFileSync(BINARY, args, { stdio: ['ignore', 'pipe', 'pipe'] });
    run('inspect', SOURCE, '--out', join(folder, 'motor'));
    run('export', join(folder, 'motor'), '--format', 'glb', '--texture', '--out', join(folder, 'out'));
    bytes = readFileSync(join(folder, 'out', 'mesh.glb'));
  }, LIMIT);
  after(() => rmSync(folder, { recursive: true }));

  it('is without an error by the Khronos validator, with one picture and places in it', LIMIT, async () => {
    const report = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 50 });
    const errors = report.issues.messages.filter((message) => message.severity === 0);
    assert.equal(report.issues.numErrors, 0, JSON.stringify(errors, null, 2));
    assert.equal(report.issues.numWarnings, 0, JSON.stringify(report.issues.messages, null, 2));
    assert.ok(report.info.hasTextures);
    const [picture] = report.info.resources.filter((resource) => resource.mimeType === 'image/png');
    assert.ok(picture.image.width % 4 === 0 && picture.image.width <= 8192, JSON.stringify(picture));
  });

  it('tells what its vertices belong to, as one without a texture does', LIMIT, async () => {
    const { components } = await semantics(bytes);
    assert.ok(components.length >= 3 && components.every((row) => row.vertices > 0 && row.area > 0));
  });
});
