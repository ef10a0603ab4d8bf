// Files without an agent: what a person chooses or drops takes the place of the live model, and a page that is served as plain files
// shows the one that its address names.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { once } from 'node:events';
import { extname, join } from 'node:path';
import { after, before, it } from 'node:test';
import { fileURLToPath } from 'node:url';
import { Ply } from './support/ply.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

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
