// Half an hour of one page that is used: inspections stream in one after the other, are turned, coloured, meshed and saved, and
// played again. After each of them the heap of the page, what its WebAssembly holds, and what the processes of the browser have
// resident (the graphics process holds the buffers) are read, after the garbage has been collected:
// node endurance.mjs [webgl2|webgpu].
// SEMASCAN_ENDURANCE_MINUTES says for how long; SEMASCAN_AGENT names a release build of the agent. Prints one JSON object:
// `growth` is the mean of the last third over that of the middle third: 1 where nothing grows.

import { readFile } from 'node:fs/promises';
import { Agent } from '../support/agent.mjs';
import { launch } from '../support/chromium.mjs';
import { Viewer } from '../support/viewer.mjs';

const MINUTES = Number(process.env.SEMASCAN_ENDURANCE_MINUTES ?? 30);
/** Parts by turns, so that the models differ in size. */
const SOURCES = [7, 8, 9].map((seed) => `virtual:starter-motor?seed=${seed}&views=5&size=320x240&errors=none`);

const backend = process.argv[2] ?? 'webgl2';
const browser = await launch(backend);
let agent = await Agent.start({ source: SOURCES[0] });
const viewer = await Viewer.open(browser, agent.url);
const cdp = await viewer.page.context().newCDPSession(viewer.page);
const rows = [];
const end = Date.now() + MINUTES * 60_000;
let saved = 0;
while (Date.now() < end) {
  await viewer.finished();
  await use(viewer);
  rows.push({ minute: Number((MINUTES - (end - Date.now()) / 60_000).toFixed(2)), ...(await memory()) });
  process.stderr.write(`${JSON.stringify(rows.at(-1))}\n`);
  // The page connects again by itself, to another inspection.
  const { port } = agent;
  const before = (await viewer.state()).inspection;
  await agent.stop();
  agent = await Agent.start({ source: SOURCES[rows.length % SOURCES.length], port });
  await viewer.until((s, before) => s.inspection && s.inspection !== before, before, 'the next inspection');
}
const errors = viewer.errors.filter((text) => !/WebSocket|ERR_CONNECTION|Failed to (fetch|load)/i.test(text));
console.log(JSON.stringify({ backend, minutes: MINUTES, inspections: rows.length, saved_bytes: saved, first: rows[0], last: rows.at(-1), ...growths(rows), errors }));
await browser.close();
await agent.stop();

/** What a person does with a finished model. */
async function use(viewer) {
  const { page } = viewer;
  for (const mode of ['component', 'confidence', 'appearance']) await viewer.colorMode(mode);
  const box = await viewer.canvas.boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let k = 0; k < 20; k++) await page.mouse.move(x + 10 * k, y + 3 * k);
  await page.mouse.up();
  await page.mouse.click(x, y);
  await page.keyboard.press('Escape');
  await viewer.choose('show-mesh');
  await page.locator('[data-testid=mesh][data-state=ready]').waitFor({ timeout: 120_000 });
  for (const kind of ['ply', 'mesh-ply', 'mesh-glb']) saved += (await viewer.export(kind)).bytes.length;
  await viewer.choose('show-points');
  await viewer.picture();
}

/** Megabytes that the page and the browser hold. */
async function memory() {
  await cdp.send('HeapProfiler.collectGarbage');
  const heap = await cdp.send('Runtime.getHeapUsage');
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send('SystemInfo.getProcessInfo');
  await session.detach();
  const resident = { page: 0, graphics: 0 };
  for (const { id, type } of processInfo) {
    const status = await readFile(`/proc/${id}/status`, 'utf8').catch(() => '');
    const megabytes = Number(status.match(/VmRSS:\s+(\d+)/)?.[1] ?? 0) / 1024;
    if (type === 'renderer') resident.page = Math.max(resident.page, megabytes);
    if (type === 'GPU') resident.graphics += megabytes;
  }
  const rounded = (value) => Number(value.toFixed(1));
  return {
    heap_mb: rounded(heap.usedSize / 1e6),
    arrays_mb: rounded((heap.backingStorageSize ?? 0) / 1e6),
    nodes: (await cdp.send('Memory.getDOMCounters')).nodes,
    page_mb: rounded(resident.page),
    graphics_mb: rounded(resident.graphics),
  };
}

/** How much of each figure the last third has for one of the middle third. */
function growths(rows) {
  const third = Math.floor(rows.length / 3);
  if (third === 0) return {};
  const mean = (rows, key) => rows.reduce((sum, row) => sum + row[key], 0) / rows.length;
  const keys = ['heap_mb', 'arrays_mb', 'nodes', 'page_mb', 'graphics_mb'];
  const growth = keys.map((key) => [key, Number((mean(rows.slice(-third), key) / mean(rows.slice(third, 2 * third), key)).toFixed(3))]);
  return { growth: Object.fromEntries(growth) };
}
