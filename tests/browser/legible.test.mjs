// What is printed on a part can be read on its mesh: a box with a grid of 2 mm, inspected, looked at from above. The photographs show it
// better than the colours of the points, which are 0.7 mm apart.

import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const { PNG } = createRequire(import.meta.url)('pngjs');

/** Period of the grid and width of its lines, mm. */
const PERIOD = 2;
const LINE = 0.7;
/** Edges of the box, mm. */
const BOX = [100, 80, 60];
/** Pixels of the print along a period. */
const PIXELS = 20;

/** Where it is looked at from, and the middle of the box's upper side, mm; the viewer's vertical field of view. */
const EYE = [0, -4, 260];
const TARGET = [0, 0, BOX[2]];
const FIELD = (35 * Math.PI) / 180;

onEveryBackend('a printed grid of 2 mm', (session, backend) => {
  let folder, agent, viewer;
  before(async () => {
    folder = await mkdtemp(join(tmpdir(), 'semascan-print-'));
    await writePrintedBox(folder);
    const path = encodeURIComponent(join(folder, 'box.obj'));
    agent = await Agent.start({ source: `virtual:mesh?path=${path}&unit=m&seed=5&views=5&size=960x720` });
    viewer = await Viewer.open(session.browser, `${agent.url}#eye=${EYE}&target=${TARGET}`);
    await viewer.finished();
  }, LIMIT);
  after(async () => {
    await viewer?.close();
    await agent?.stop();
    if (folder) await rm(folder, { recursive: true });
  });

  it('is legible in photographs, more than in the colours of points', LIMIT, async () => {
    await viewer.colorMode('appearance');
    const points = amplitude(await viewer.picture());
    await viewer.choose('color-mode-photo');
    const ready = viewer.page.locator('[data-testid=photo-key][data-state=ready]:not([data-views=""])');
    await ready.waitFor({ timeout: 120_000 });
    const photographs = amplitude(await viewer.picture());
    console.log(`${backend}: amplitude of the grid ${photographs.toFixed(1)} levels in photographs, ${points.toFixed(1)} in points`);
    assert.ok(photographs > 20, `${photographs} levels`);
    assert.ok(photographs > 1.3 * points, `${photographs} against ${points} levels`);
    viewer.assertNoErrors();
  });
});

/** A box with the grid on all of its sides, as OBJ in metres with its MTL and picture. */
async function writePrintedBox(folder) {
  const size = 10 * PIXELS;
  const print = new PNG({ width: size, height: size });
  const isLine = (pixel) => ((pixel % PIXELS) / PIXELS) * PERIOD < LINE;
  for (let i = 0; i < size * size; i++) {
    const level = isLine(i % size) || isLine(Math.floor(i / size)) ? 50 : 205;
    print.data.set([level, level, level, 255], 4 * i);
  }
  await writeFile(join(folder, 'grid.png'), PNG.sync.write(print));
  await writeFile(join(folder, 'box.mtl'), 'newmtl print\nKd 1 1 1\nmap_Kd grid.png\n');
  const lines = ['mtllib box.mtl', 'usemtl print'];
  const faces = [];
  for (let axis = 0; axis < 3; axis++) {
    const [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    for (const side of [0, 1]) {
      const first = 8 * axis + 4 * side + 1;
      for (const [s, t] of [[0, 0], [1, 0], [1, 1], [0, 1]]) {
        const place = [0, 0, 0];
        [place[axis], place[a], place[b]] = [side * BOX[axis], s * BOX[a], t * BOX[b]];
        lines.push(`v ${(place[0] - BOX[0] / 2) / 1e3} ${(place[1] - BOX[1] / 2) / 1e3} ${place[2] / 1e3}`);
        // The picture holds ten periods and repeats.
        lines.push(`vt ${(s * BOX[a]) / (10 * PERIOD)} ${(t * BOX[b]) / (10 * PERIOD)}`);
      }
      const order = side ? [0, 1, 2, 3] : [3, 2, 1, 0];
      faces.push(`f ${order.map((k) => `${first + k}/${first + k}`).join(' ')}`);
    }
  }
  await writeFile(join(folder, 'box.obj'), [...lines, ...faces, ''].join('\n'));
}

/** Largest amplitude (levels of 255) of a wave of the grid's period, over all directions, in the middle of a picture from above. */
function amplitude(picture) {
  const distance = Math.hypot(...EYE.map((c, k) => c - TARGET[k]));
  const period = (PERIOD * picture.height) / 2 / Math.tan(FIELD / 2) / distance;
  const half = Math.round(4 * period);
  const [middle, centre] = [picture.width >> 1, picture.height >> 1];
  const patch = [];
  for (let y = -half; y < half; y++) {
    for (let x = -half; x < half; x++) {
      const [r, g, b] = picture.at((centre + y) * picture.width + middle + x);
      patch.push({ x, y, level: (r + g + b) / 3 });
    }
  }
  const mean = patch.reduce((sum, { level }) => sum + level, 0) / patch.length;
  let largest = 0;
  for (let degrees = 0; degrees < 180; degrees += 2) {
    // The height of the surface is known to a millimetre only.
    for (const stretch of [0.98, 1, 1.02]) {
      const turn = (degrees * Math.PI) / 180;
      const wave = (2 * Math.PI) / (period * stretch);
      let [re, im] = [0, 0];
      for (const { x, y, level } of patch) {
        const phase = wave * (x * Math.cos(turn) + y * Math.sin(turn));
        re += (level - mean) * Math.cos(phase);
        im += (level - mean) * Math.sin(phase);
      }
      largest = Math.max(largest, (2 * Math.hypot(re, im)) / patch.length);
    }
  }
  return largest;
}
