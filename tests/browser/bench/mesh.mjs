// Times the mesh of a model of at least half a million points in Chromium, from the click to the finished mesh in the
// page: node mesh.mjs. SEMASCAN_AGENT names a release build of the agent. Prints one JSON object.

import assert from 'node:assert/strict';
import { Agent } from '../support/agent.mjs';
import { launch } from '../support/chromium.mjs';
import { Viewer } from '../support/viewer.mjs';

const SOURCE = 'virtual:starter-motor?seed=7&views=12&size=1920x1200&errors=none';
const VOXEL_MM = 0.4;
const POINTS = 500_000;

/** Milliseconds from the click on the label of `show` until the mesh is there. */
const timed = (viewer, show) =>
  viewer.page.evaluate(async (show) => {
    const panel = document.querySelector('[data-testid=mesh]');
    const ready = new Promise((resolve) => {
      new MutationObserver(() => panel.dataset.state === 'ready' && resolve(performance.now())).observe(panel, {
        attributes: true,
      });
    });
    const begun = performance.now();
    document.querySelector(`[data-testid=${show}]`).closest('label').click();
    return (await ready) - begun;
  }, show);

const agent = await Agent.start({ source: SOURCE, voxel: VOXEL_MM });
const browser = await launch('webgl2');
try {
  const viewer = await Viewer.open(browser, agent.url);
  await viewer.finished();
  const points = (await viewer.points()).reduce((sum, count) => sum + count, 0);
  assert.ok(points >= POINTS, `the model has ${points} points only`);
  // The picture at rest: what the rasterizer still has to draw would take the mesher's core.
  await viewer.picture();
  const mesh_ms = await timed(viewer, 'show-mesh');
  const triangles = Number(await viewer.page.getByTestId('mesh').getAttribute('data-triangles'));
  console.log(JSON.stringify({ engine: `Chromium ${browser.version()}`, points, triangles, mesh_ms }));
  await viewer.close();
} finally {
  await browser.close();
  await agent.stop();
}
