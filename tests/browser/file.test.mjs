// Files without an agent: what a person chooses or drops takes the place of the live model, and a page that is served as plain files
// shows the one that its address names.

import assert from 'node:assert/strict';
import { execFile } from 'node:child_process';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { once } from 'node:events';
import { extname, join } from 'node:path';
import { after, before, it } from 'node:test';
import { fileURLToPath } from 'node:url';
import { tmpdir } from 'node:os';
import { promisify } from 'node:util';
import { BINARY, SOURCE } from './support/agent.mjs';
import { Ply } from './support/ply.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** Vertices along a side of the sheet. */
const SIDE = 33;
const share = (k) => k / (SIDE - 1);
/** Corners of its triangles. */
const TRIANGLES = Array.from({ length: (SIDE - 1) ** 2 }, (_, k) => k + Math.floor(k / (SIDE - 1))).flatMap((a) => [a, a + 1, a + SIDE + 1, a, a + SIDE + 1, a + SIDE]);
const VERTICES = Array.from({ length: SIDE ** 2 }, (_, k) => [share(k % SIDE), share(Math.floor(k / SIDE))]);

/** A square in the plane of the table as OBJ, all of a picture on it. */
function sheetObj() {
  const vertices = VERTICES.map(([u, v]) => `v ${100 * u} ${100 * v} 0\nvt ${u} ${v}\n`).join('');
  const corner = (k) => `${TRIANGLES[k] + 1}/${TRIANGLES[k] + 1}`;
  const faces = Array.from({ length: TRIANGLES.length / 3 }, (_, k) => `f ${corner(3 * k)} ${corner(3 * k + 1)} ${corner(3 * k + 2)}\n`).join('');
  return `mtllib sheet.mtl\nusemtl skin\n${vertices}${faces}`;
}

/** The same as GLB with its picture within. */
function sheet(picture, texture = { source: 0 }) {
  const floats = (numbers) => Buffer.from(new Float32Array(numbers.flat()).buffer);
  const columns = [floats(VERTICES.map(([u, v]) => [0.1 * u, 0, -0.1 * v])), floats(VERTICES.map(([u, v]) => [u, 1 - v])), Buffer.from(new Uint32Array(TRIANGLES).buffer), picture];
  const binary = Buffer.concat([...columns, Buffer.alloc(3)]);
  let byteOffset = 0;
  const bufferViews = columns.map(({ length }) => ({ buffer: 0, byteOffset: (byteOffset += length) - length, byteLength: length }));
  const json = {
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, TEXCOORD_0: 1 }, indices: 2, material: 0 }] }],
    accessors: [
      { bufferView: 0, componentType: 5126, count: VERTICES.length, type: 'VEC3' },
      { bufferView: 1, componentType: 5126, count: VERTICES.length, type: 'VEC2' },
      { bufferView: 2, componentType: 5125, count: TRIANGLES.length, type: 'SCALAR' },
    ],
    bufferViews, buffers: [{ byteLength: binary.length }],
    materials: [{ pbrMetallicRoughness: { baseColorTexture: { index: 0 } }, extensions: { KHR_materials_unlit: {} } }],
    textures: [texture], images: [{ bufferView: 3, mimeType: 'image/jpeg' }],
  };
  const chunk = (kind, bytes, fill) => {
    const head = Buffer.alloc(8);
    const padded = Buffer.concat([bytes, Buffer.alloc(-bytes.length & 3, fill)]);
    head.writeUInt32LE(padded.length, 0);
    head.write(kind, 4, 'latin1');
    return Buffer.concat([head, padded]);
  };
  const chunks = Buffer.concat([chunk('JSON', Buffer.from(JSON.stringify(json)), ' '), chunk('BIN\0', binary, 0)]);
  const head = Buffer.from('glTF\x02\0\0\0\0\0\0\0', 'latin1');
  head.writeUInt32LE(12 + chunks.length, 8);
  return Buffer.concat([head, chunks]);
}

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const DIST = fileURLToPath(new URL('../../www/dist', import.meta.url));
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm', '.css': 'text/css', '.svg': 'image/svg+xml' };

/** Two triangles in groups of their own, in millimetres. */
const OBJ = 'o lid\nv 0 0 0\nv 40 0 0\nv 40 40 0\nf 1 2 3\no base\nv 0 0 9\nv 40 0 9\nv 40 40 9\nf 4 5 6\n';

onEveryBackend(
  'files without an agent',
  (session) => {
    let viewer, page, cloud, scene, live, server;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      await viewer.finished();
      cloud = (await viewer.export('ply')).bytes;
      await viewer.colorMode('component');
      live = await viewer.picture();
      await viewer.choose('show-mesh');
      await page.locator('[data-testid=mesh][data-state=ready]').waitFor({ timeout: 120_000 });
      scene = (await viewer.export('mesh-glb')).bytes;
    }, LIMIT);
    after(async () => {
      await viewer?.close();
      server?.close();
    });

    const part = (of, name) => of.page.getByTestId('part').getByText(name, { exact: true }).waitFor({ timeout: 60_000 });
    const opened = async (of, name) => {
      await part(of, name);
      // What is drawn of it: points, or a mesh in their place.
      return of.until((s) => s.connection === 'file' && Number(s.points) + Number(s.triangles ?? 0) > 0, null, `the model of ${name}`, 60_000);
    };
    const open = (name, bytes) => page.getByTestId('open-file').setInputFiles({ name, mimeType: 'application/octet-stream', buffer: Buffer.from(bytes) });

    it('shows the cloud that it saved, as it was', LIMIT, async () => {
      const { classes } = new Ply(cloud);
      await open('motor.ply', cloud);
      await opened(viewer, 'motor');
      assert.deepEqual(await page.locator('[data-testid^=legend-row-]').count(), classes.length);
      await viewer.colorMode('component');
      await page.keyboard.press('f');
      const colors = classes.filter((c) => c.id > 0).map((c) => c.color);
      const [now, then] = [(await viewer.picture()).byHue(colors), live.byHue(colors)];
      now.forEach((pixels, i) => assert.ok(Math.abs(pixels - then[i]) < 0.25 * then[i] + 60, `${now} for ${then}`));
      assert.equal(await page.getByTestId('review').count(), 0, 'nothing is asked of the agent');
      assert.equal(await page.getByTestId('correct').count(), 0);
      const again = new Ply((await viewer.export('ply')).bytes);
      assert.equal(again.count, new Ply(cloud).count);
    });

    it('shows a mesh with its components, dropped onto the page', LIMIT, async () => {
      await page.evaluate((bytes) => {
        const data = new DataTransfer();
        data.items.add(new File([new Uint8Array(bytes)], 'scene.glb'));
        window.dispatchEvent(new DragEvent('dragover', { dataTransfer: data, bubbles: true, cancelable: true }));
        if (!document.body.hasAttribute('data-dropping')) throw new Error('nothing says that a file may be dropped');
        window.dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true }));
      }, [...scene]);
      await opened(viewer, 'scene');
      await page.locator('[data-testid=mesh][data-state=ready]').waitFor({ timeout: 60_000 });
      assert.ok(Number(await page.getByTestId('mesh').getAttribute('data-triangles')) > 1000);
      assert.equal(await page.getByTestId('show-mesh').isChecked(), true);
      const names = await page.locator('[data-testid^=legend-row-]').allInnerTexts();
      const { classes } = new Ply(cloud);
      const seen = classes.filter((c) => c.id > 0 && names.some((name) => name.toLowerCase().includes(c.name)));
      assert.ok(seen.length >= 3, `${names}`);
      assert.ok(names.every((name) => !name.includes('%')), `no file of this kind says how sure it is: ${names}`);
      const drawn = (await viewer.picture()).drawn();
      assert.ok(drawn > 0.3 * live.drawn(), `${drawn} pixels of the mesh, ${live.drawn()} of the live model`);
    });

    it('opens a foreign mesh and says what it takes its numbers for', LIMIT, async () => {
      await open('box.obj', Buffer.from(OBJ));
      await opened(viewer, 'box');
      await page.getByText('taken for millimetres').waitFor({ timeout: 10_000 });
      assert.equal((await viewer.points()).reduce((sum, points) => sum + points, 0), 6);
    });

    it('shows the pictures of a scene, and of a model that is opened with its material library', LIMIT, async () => {
      const colors = [[230, 30, 30], [30, 160, 30], [30, 60, 230], [230, 200, 20]];
      const picture = (type) => page.evaluate(async ([colors, type]) => {
        const canvas = new OffscreenCanvas(64, 64);
        const context = canvas.getContext('2d');
        colors.forEach((color, k) => {
          context.fillStyle = `rgb(${color})`;
          context.fillRect(32 * (k % 2), 32 * Math.floor(k / 2), 32, 32);
        });
        return [...new Uint8Array(await (await canvas.convertToBlob({ type })).arrayBuffer())];
      }, [colors, type]);
      const seen = async (name, files) => {
        // The remark goes away by itself, maybe before there is a picture on a slow machine.
        const model = [files].flat().at(-1).name;
        const remark = page.getByText(`${model}: its pictures are shown as colours at its vertices`).waitFor({ timeout: 60_000 });
        await page.getByTestId('open-file').setInputFiles(files);
        await Promise.all([opened(viewer, name), remark]);
        await viewer.colorMode('appearance');
        await page.keyboard.press('f');
        const pixels = (await viewer.picture()).byHue(colors);
        assert.ok(pixels.every((count) => count > 0.2 * Math.max(...pixels) && count > 500), `${name}: ${pixels}`);
      };
      const file = (name, content) => ({ name, mimeType: 'application/octet-stream', buffer: Buffer.from(content) });
      await seen('textured', file('textured.glb', sheet(Buffer.from(await picture('image/jpeg')))));
      const png = file('skin.png', await picture('image/png'));
      await seen('sheet', [png, file('sheet.mtl', 'newmtl skin\nmap_Kd skin.png\n'), file('sheet.obj', sheetObj())]);
    });

    it('shows the views of a recording as their camera measured them', LIMIT, async () => {
      const folder = await mkdtemp(join(tmpdir(), 'semascan-recording-'));
      try {
        const path = join(folder, 'views.mcap');
        await promisify(execFile)(BINARY, ['convert', SOURCE, path]);
        const remark = page.getByText('the points of 5 views').waitFor({ timeout: 60_000 });
        await page.getByTestId('open-file').setInputFiles(path);
        await Promise.all([opened(viewer, 'views'), remark]);
      } finally {
        await rm(folder, { recursive: true });
      }
      await viewer.colorMode('appearance');
      await page.keyboard.press('f');
      const drawn = (await viewer.picture()).drawn();
      const points = Number((await viewer.state()).points);
      assert.ok(points > 10_000, `${points} points`);
      assert.ok(drawn > 2000, `${drawn} pixels`);
    });

    it('names what of a scene it cannot show, and a recording of which it can show nothing', LIMIT, async () => {
      await open('packed.glb', sheet(Buffer.from([1]), { extensions: { KHR_texture_basisu: { source: 0 } } }));
      await opened(viewer, 'packed');
      await page.getByText('KTX2 (KHR_texture_basisu) is not read').first().waitFor({ timeout: 10_000 });
      await open('cut.mcap', Buffer.from('\x89MCAP0\r\n', 'latin1'));
      await page.getByText('cut.mcap holds a recording (MCAP) of which nothing can be shown').first().waitFor({ timeout: 20_000 });
      await part(viewer, 'packed');
      await open('box.obj', Buffer.from(OBJ));
      await opened(viewer, 'box');
    });

    it('says what cannot be opened, and keeps what is shown', LIMIT, async () => {
      await open('broken.glb', Buffer.from('glTF but no more'));
      await page.getByText('The file was not opened').waitFor({ timeout: 20_000 });
      await part(viewer, 'box');
      await page.evaluate(await readFile(AXE, 'utf8'));
      const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] }));
      assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.map((n) => n.target).join('; ')}`), []);
    });

    it('goes back to the agent when the file is closed', LIMIT, async () => {
      await page.getByTestId('close-file').click();
      await viewer.finished();
      assert.equal((await viewer.state()).connection, 'connected');
    });

    it('shows the file that the address names where plain files are served', LIMIT, async () => {
      server = createServer(async (request, answer) => {
        const asked = decodeURIComponent(new URL(request.url, 'http://a').pathname);
        if (asked === '/motor.ply') return answer.end(cloud);
        const path = asked === '/' ? '/index.html' : asked;
        const body = await readFile(join(DIST, path)).catch(() => null);
        if (!body) return answer.writeHead(404).end();
        answer.setHeader('content-type', TYPES[extname(path)] ?? 'application/octet-stream');
        answer.end(body);
      });
      server.listen(0, '127.0.0.1');
      await once(server, 'listening');
      const url = `http://127.0.0.1:${server.address().port}/`;
      const alone = await Viewer.open(session.browser, `${url}?model=motor.ply`);
      try {
        await opened(alone, 'motor');
        assert.ok((await alone.points()).reduce((sum, points) => sum + points, 0) > 1000);
        alone.assertNoErrors([/api\/v1\/me|404/]);
      } finally {
        await alone.close();
      }
      const missing = await Viewer.open(session.browser, `${url}?model=nothing.ply`);
      try {
        await missing.page.getByText('nothing.ply could not be loaded').first().waitFor({ timeout: 20_000 });
      } finally {
        await missing.close();
      }
    });

    it('logs no error', LIMIT, () => viewer.assertNoErrors());
  },
  { agent: {} },
);
