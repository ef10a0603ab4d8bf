// The same points drawn by three.js in the same browser: positions and colours of the model, as large as the viewer's splats, on a
// canvas of the same size, from the same place, turned by the same steps. What the viewer is measured against.

import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import path from 'node:path';
import { newPage } from '../support/chromium.mjs';

/** Where three.js lies. */
const ROOT = path.dirname(path.dirname(createRequire(import.meta.url).resolve('three')));
/** Path below which its files are served, beside the agent's own. */
const PREFIX = '/three-js/';
/** Half the angle of view, degrees, and the size of a splat in voxels: those of the viewer. */
const [FOV, SPLAT_VOXELS] = [35, 1.9];

const PAGE = `<!doctype html><html><head><script type="importmap">{"imports":{"three":"${PREFIX}build/three.module.js"}}</script></head>
<body style="margin:0;overflow:hidden"></body></html>`;

/**
 * Times three.js: `draw_ms`, milliseconds of each frame until a pixel of it can be read; `frame_ms`, between frames without
 * reading.
 * @param {{url: string, cloud: string, width: number, height: number, eye: number[], target: number[], voxel: number,
 *   turn: number, frames: number, limit: number}} scene `cloud` is the path of a PLY file at the agent's `url`; `eye` and `target`
 *   in metres, `turn` in radians a frame, `limit` in milliseconds
 */
export async function drawnByThree(browser, scene) {
  const page = await newPage(browser, { width: scene.width, height: scene.height });
  const errors = [];
  page.on('pageerror', (error) => errors.push(String(error)));
  await page.route(`**${PREFIX}**`, async (route) => {
    const name = new URL(route.request().url()).pathname.slice(PREFIX.length);
    if (name === 'page.html') return route.fulfill({ contentType: 'text/html', body: PAGE });
    return route.fulfill({ contentType: 'text/javascript', body: await readFile(path.join(ROOT, name)) });
  });
  try {
    await page.goto(`${scene.url}${PREFIX}page.html`);
    const frames = await page.evaluate(draw, { ...scene, loader: `${PREFIX}examples/jsm/loaders/PLYLoader.js`, fov: FOV, splat: SPLAT_VOXELS });
    if (errors.length > 0) throw new Error(errors.join('; '));
    return frames;
  } finally {
    await page.context().close();
  }
}

/** Runs in the page. */
async function draw({ cloud, loader, width, height, eye, target, voxel, turn, frames, limit, fov, splat }) {
  const THREE = await import('three');
  const { PLYLoader } = await import(loader);
  const geometry = await new PLYLoader().loadAsync(cloud);
  const points = geometry.getAttribute('position').count;
  for (const name of Object.keys(geometry.attributes)) {
    if (name !== 'position' && name !== 'color') geometry.deleteAttribute(name);
  }
  const renderer = new THREE.WebGLRenderer({ antialias: false });
  renderer.setSize(width, height);
  document.body.append(renderer.domElement);
  const scene = new THREE.Scene();
  scene.add(new THREE.Points(geometry, new THREE.PointsMaterial({ size: splat * voxel, vertexColors: true })));
  const camera = new THREE.PerspectiveCamera(fov, width / height, 0.01, 10);
  camera.up.set(0, 0, 1);
  const [centre, arm] = [new THREE.Vector3(...target), new THREE.Vector3(...eye).sub(new THREE.Vector3(...target))];
  const one = new Uint8Array(4);
  const gl = renderer.getContext();
  const render = (frame) => {
    camera.position.copy(arm).applyAxisAngle(camera.up, frame * turn).add(centre);
    camera.lookAt(centre);
    renderer.render(scene, camera);
  };
  const shown = () => new Promise((resolve) => requestAnimationFrame(resolve));
  render(0);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, one);
  const [draw_ms, frame_ms] = [[], []];
  let end = performance.now() + limit;
  for (let frame = 0; frame < frames && performance.now() < end; frame++) {
    await shown();
    const begun = performance.now();
    render(frame);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, one);
    draw_ms.push(performance.now() - begun);
  }
  end = performance.now() + limit;
  let last = await shown();
  for (let frame = 0; frame < frames && performance.now() < end; frame++) {
    render(frame);
    const now = await shown();
    frame_ms.push(now - last);
    last = now;
  }
  return { points, draw_ms, frame_ms };
}
