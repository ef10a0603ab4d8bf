// Times how the viewer draws large models in Chromium on the machine's graphics, and three.js beside it on WebGL2 in the same
// browser: node render.mjs [webgpu] [webgl2] [MODEL..].
// SEMASCAN_AGENT names a release build of the agent. Prints one JSON object; a picture of each run stays in `out/`.
//
// Without graphics hardware Chromium's software rasterizer draws; `adapter` says who did. `frame_ms` is the time
// between frames while the model turns, as a person sees it: at best the screen's, and of as many points as the viewer
// then draws. `draw_ms` is the time of a frame of the whole model until a pixel of it can be read, `read_ms` what the
// reading alone takes. Ratios are those of three.js's times to the viewer's: above 1 the viewer is faster. Software draws
// 1280x720, hardware 1920x1080.

import assert from 'node:assert/strict';
import { mkdir, writeFile } from 'node:fs/promises';
import { Agent } from '../support/agent.mjs';
import { BACKENDS, launch, newPage } from '../support/chromium.mjs';
import { Viewer } from '../support/viewer.mjs';
import { HostileLink } from '../support/hostile.mjs';
import { Sender } from '../support/sender.mjs';
import { drawnByThree } from './three.mjs';

/** Motors by about their number of points. */
const MODELS = {
  motor_2m: { source: 'virtual:starter-motor?seed=7&views=12&size=1920x1200', voxel: 0.5 },
  motor_10m: { source: 'virtual:starter-motor?seed=7&views=18&size=1920x1200', voxel: 0.15 },
  // Planes above each other, sent after an agent's first chunk: fusing so many points takes the agent long.
  planes_20m: { points: 20_000_000, voxel: 0.1 },
};
/** Points of a chunk of planes. */
const CHUNK_POINTS = 1024;

/** Sizes of the page: its panels leave 1920 x 1080 and 1280 x 720 to the canvas. */
const PAGES = { hardware: { width: 2296, height: 1232 }, software: { width: 1656, height: 872 } };

/** Names of adapters that are no hardware. */
const SOFTWARE = /swiftshader|llvmpipe|basic render/i;

/** Where the camera begins and what it looks at, metres, table frame. */
const EYE = { motor: [0.32, -0.28, 0.28], planes: [0.32, -0.18, 0.28] };
const TARGET = { motor: [0, 0, 0.05], planes: [0.1, 0.1, 0] };
/** What a step of the pointer turns the camera by, radians. */
const TURN = 0.015;
const OUT = new URL('../out/', import.meta.url);

/** Frames of an orbit, and the longest it may take where they come slowly. */
const FRAMES = 300;
const LIMIT_MS = 10_000;
/** Orbits with read-back: each ends with the whole model even where it moves with fewer points. */
const STROKES = 3;

/** A backend that takes so long for a frame of a whole motor is spared the larger ones; planes are drawn whole once. */
const TOO_SLOW_MS = 500;

/** Longest wait for the agent to build a model. */
const FUSE_LIMIT_MS = 600_000;

/** Longest wait for the first points in the viewer. */
const START_LIMIT_MS = 60_000;

/** Runs in the page before its scripts: keeps for every frame that the viewer draws when, how long and of how much. */
function watch() {
  const kept = (window.renderBench = { frames: [], readBack: true });
  const ask = window.requestAnimationFrame.bind(window);
  const readPixel = (canvas) => {
    // A fresh one each time: the browser moves a canvas that is read often off the graphics processor.
    const one = Object.assign(document.createElement('canvas'), { width: 1, height: 1 }).getContext('2d');
    one.drawImage(canvas, -canvas.width / 2, -canvas.height / 2);
    one.getImageData(0, 0, 1, 1);
  };
  window.requestAnimationFrame = (callback) =>
    ask((now) => {
      const canvas = document.getElementById('viewport');
      const before = canvas?.dataset.frames;
      const begun = performance.now();
      callback(now);
      if (!canvas || canvas.dataset.frames === before) return;
      const script = performance.now() - begun;
      if (kept.readBack) readPixel(canvas);
      const at = performance.now();
      if (kept.readBack) readPixel(canvas);
      const read = performance.now() - at;
      kept.frames.push({ now, script, draw: at - begun, read, at, points: Number(canvas.dataset.points) });
    });
}

/**
 * Drags the model around by a step for each animation frame and gives back the frames drawn, up to the one at rest that
 * shows all `points`. The events are made in the page: sent from outside they would come at their own rate.
 */
const orbit = (viewer, options) =>
  viewer.page.evaluate(async ({ points, count, limit, readBack }) => {
    const kept = Object.assign(window.renderBench, { frames: [], readBack });
    const canvas = document.getElementById('viewport');
    const { left, top, width, height } = canvas.getBoundingClientRect();
    let x = left + width / 2;
    const send = (type) =>
      canvas.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX: x, clientY: top + height / 2 }));
    const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
    const end = performance.now() + limit;
    send('pointerdown');
    while (kept.frames.length < count && performance.now() < end) {
      x += 3;
      send('pointermove');
      await frame();
    }
    send('pointerup');
    const moving = kept.frames.length;
    while (kept.frames.at(-1)?.points !== points) await frame();
    return { moving: kept.frames.slice(0, moving), all: kept.frames };
  }, options);

/** Who draws, as the browser tells it. */
const adapter = (viewer, backend) =>
  viewer.page.evaluate(async (backend) => {
    if (backend === 'webgpu') {
      const { vendor, architecture, device, description } = (await navigator.gpu.requestAdapter()).info;
      return [vendor, architecture, device, description].filter(Boolean).join(' ');
    }
    const gl = document.createElement('canvas').getContext('webgl2');
    return gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER);
  }, backend);

/** The frames drawn since the page was opened, or since an orbit began. */
const frames = (viewer) => viewer.page.evaluate(() => window.renderBench.frames);

const toggle = (viewer, id) =>
  viewer.page.evaluate((id) => document.querySelector(`[data-testid=${id}]`).click(), id);

const quantile = (values, q) => {
  const sorted = values.toSorted((a, b) => a - b);
  return Number(sorted[Math.max(Math.ceil(q * sorted.length) - 1, 0)]?.toFixed(3));
};
const spread = (values) => ({ median: quantile(values, 0.5), p95: quantile(values, 0.95), count: values.length });

/** Opens the viewer, and watches it from its first frame on. */
async function open(browser, agent, backend, size, kind) {
  const page = await newPage(browser, size);
  await page.addInitScript(watch);
  const viewer = new Viewer(page);
  const millimetres = (place) => place.map((c) => c * 1000).join(',');
  await page.goto(`${agent.url}/?renderer=${backend}#eye=${millimetres(EYE[kind])}&target=${millimetres(TARGET[kind])}`);
  // The renderer tests itself with a point of its own: only more than that says that it draws.
  const drawn = (s) => s.backend === 'none' || Number(s.points) > 1;
  const { backend: found } = await viewer.until(drawn, null, 'the first points', START_LIMIT_MS);
  assert.equal(found, backend, viewer.errors.join('; '));
  return viewer;
}

/** A browser with the viewer: on the machine's graphics, and where these do not draw on the software rasterizer. */
async function start(agent, backend, kind) {
  for (const hardware of [true, false]) {
    const browser = await launch(backend, { hardware });
    try {
      const viewer = await open(browser, agent, backend, hardware ? PAGES.hardware : PAGES.software, kind);
      const name = await adapter(viewer, backend);
      if (hardware && SOFTWARE.test(name)) throw new Error(`it is ${name}`);
      return { browser, viewer };
    } catch (error) {
      await browser.close();
      if (!hardware) throw error;
      console.error(`${backend} on the machine's graphics: ${error.message}`);
    }
  }
}

async function measure(agent, backend, name, { points: planes, voxel }) {
  const kind = planes ? 'planes' : 'motor';
  const { browser, viewer } = await start(agent, backend, kind);
  try {
    if (planes) await viewer.until((s, points) => Number(s.points) >= points, planes, 'the planes', FUSE_LIMIT_MS);
    else await viewer.finished();
    await viewer.picture();
    const loading = await frames(viewer);
    const shown = loading.at(-1).points;
    // Most points of a view belong to the table and are hidden at first: the picture is to have every point there is.
    for (const kind of ['outliers', 'background']) await toggle(viewer, `show-${kind}`);
    const picture = await viewer.picture();
    await mkdir(OUT, { recursive: true });
    await writeFile(new URL(`render-${name}-${backend}.png`, OUT), picture.png);
    const { points } = (await frames(viewer)).at(-1);

    const { moving } = await orbit(viewer, { points, count: FRAMES, limit: LIMIT_MS, readBack: false });
    const drawn = [];
    for (let stroke = 0; stroke < (planes ? 0 : STROKES); stroke++) {
      const share = { count: FRAMES / STROKES, limit: LIMIT_MS / STROKES };
      drawn.push(...(await orbit(viewer, { points, ...share, readBack: true })).all);
    }
    const whole = drawn.filter((frame) => frame.points === points);
    const canvas = await viewer.canvas.evaluate((canvas) => `${canvas.width}x${canvas.height}`);
    const result = {
      engine: `Chromium ${browser.version()}`,
      adapter: await adapter(viewer, backend),
      canvas,
      points,
      open_to_whole_ms: Math.round(loading.find((frame) => frame.points === shown).at),
      frame_ms: spread(moving.slice(1).map((frame, i) => frame.now - moving[i].now)),
      script_ms: spread(moving.map((frame) => frame.script)),
      points_moving: quantile(moving.map((frame) => frame.points), 0.5),
      draw_ms: spread(whole.map((frame) => frame.draw)),
      read_ms: spread(whole.map((frame) => frame.read)),
    };
    viewer.assertNoErrors();
    const { inspection } = await viewer.state();
    await viewer.close();
    if (backend === 'webgl2' && !planes) {
      const [width, height] = canvas.split('x').map(Number);
      const cloud = `/api/v1/inspections/${inspection}/exports/cloud.ply`;
      const scene = { url: new URL(agent.url).origin, cloud, width, height, eye: EYE.motor, target: TARGET.motor, voxel: voxel / 1000, turn: TURN };
      const three = await drawnByThree(browser, { ...scene, frames: FRAMES, limit: LIMIT_MS });
      assert.equal(three.points, points, 'three.js draws the same points');
      result.three_draw_ms = spread(three.draw_ms);
      result.three_frame_ms = spread(three.frame_ms);
      result.ratio_whole = Number((result.three_draw_ms.median / result.draw_ms.median).toFixed(2));
      result.ratio_moving = Number((result.three_frame_ms.median / result.frame_ms.median).toFixed(2));
    }
    console.error(`${name} on ${backend}: ${JSON.stringify(result)}`);
    return result;
  } finally {
    await browser.close();
  }
}

/** Waits until the agent has the whole model: what the viewer then waits for is the stream and itself. */
async function fused(agent) {
  const deadline = Date.now() + FUSE_LIMIT_MS;
  while (!/finished: \d+ points/.test(agent.log)) {
    assert.ok(agent.alive && Date.now() < deadline, `the model was not finished:\n${agent.log}`);
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

const chosen = process.argv.slice(2);
const named = Object.keys(MODELS).filter((name) => chosen.includes(name));
let backends = BACKENDS.filter((backend) => chosen.includes(backend));
if (backends.length === 0) backends = BACKENDS;
const report = {};
const slow = new Set();
for (const name of named.length > 0 ? named : Object.keys(MODELS)) {
  const results = (report[name] = {});
  const { points, ...model } = MODELS[name];
  const able = points ? backends : backends.filter((backend) => !slow.has(backend));
  if (able.length === 0) continue;
  const agent = await Agent.start(points ? {} : model);
  try {
    if (!points) await fused(agent);
    for (const backend of able) {
      const sender = new Sender({ points: CHUNK_POINTS, voxel: model.voxel / 1000, chunks: Math.ceil(points / CHUNK_POINTS) });
      const link = points ? await HostileLink.to(agent.port, (message, send) => sender.follow(message, send)) : agent;
      results[backend] = await measure(link, backend, name, MODELS[name]);
      if (points) await link.close();
    }
    for (const backend of able) if (results[backend].draw_ms.median >= TOO_SLOW_MS) slow.add(backend);
  } finally {
    await agent.stop();
  }
}
console.log(JSON.stringify(report));
