// The instruments themselves: a test is worth no more than what it measures with.

import assert from 'node:assert/strict';
import { connect, createServer } from 'node:net';
import { once } from 'node:events';
import { after, before, describe, it } from 'node:test';
import { PNG } from 'pngjs';
import { Link } from './support/link.mjs';
import { Picture } from './support/pixels.mjs';
import { Ply } from './support/ply.mjs';

/** A picture of one row whose pixels are `colors`. */
function row(colors) {
  const png = new PNG({ width: colors.length, height: 1 });
  colors.forEach(([r, g, b], i) => png.data.set([r, g, b, 255], 4 * i));
  return new Picture(PNG.sync.write(png));
}

describe('pictures', () => {
  it('tell the model from its background', () => {
    const picture = row([[20, 20, 24], [22, 21, 24], [120, 120, 120], [200, 60, 40]]);
    assert.equal(picture.drawn(), 2);
    assert.equal(picture.coloured(), 1);
  });

  it('know a class colour in light and in shade, and leave grey alone', () => {
    const picture = row([[0, 0, 0], [59, 130, 196], [30, 65, 98], [230, 159, 0], [140, 140, 140]]);
    const classes = [[59, 130, 196], [230, 159, 0], [140, 147, 156], [128, 128, 128]];
    assert.deepEqual(picture.byHue(classes), [2, 1, 0, 0]);
  });

  it('differ by the share of pixels that a person would see', () => {
    const before = row([[0, 0, 0], [10, 10, 10], [100, 0, 0], [200, 0, 0]]);
    const after = row([[0, 0, 0], [12, 12, 12], [100, 0, 0], [100, 0, 0]]);
    assert.equal(after.difference(before), 0.25);
    assert.equal(row([[0, 0, 0]]).difference(before), 1);
  });
});

describe('point clouds', () => {
  const header =
    'ply\nformat binary_little_endian 1.0\ncomment label 3 drive end #e69f00\nelement vertex 2\n' +
    'property float32 x\nproperty uint8 red\nproperty uint16 label\nend_header\n';

  it('are read by their header', () => {
    const body = Buffer.from([0, 0, 128, 63, 7, 3, 0, 0, 0, 0, 64, 9, 0, 1]);
    const ply = new Ply(Buffer.concat([Buffer.from(header), body]));
    assert.deepEqual(ply.column('x'), [1, 2]);
    assert.deepEqual(ply.column('label'), [3, 256]);
    assert.deepEqual(ply.classes, [{ id: 3, name: 'drive end', color: [230, 159, 0] }]);
  });

  it('without a header are refused', () => {
    assert.throws(() => new Ply(Buffer.from('solid cube')), /no PLY header/);
  });
});

describe('the wire', () => {
  let agent, link;
  const browsers = [];
  before(async () => {
    agent = createServer((socket) => socket.on('error', () => {}).on('data', () => socket.write('x'.repeat(1000))));
    agent.listen(0, '127.0.0.1');
    await once(agent, 'listening');
    link = await Link.to(agent.address().port);
  });
  after(async () => {
    browsers.forEach((socket) => socket.destroy());
    await link?.close();
    agent?.close();
  });

  it('counts, knows sockets from pages, and cuts', { timeout: 10_000 }, async () => {
    const page = await ask('GET /index.html HTTP/1.1\r\nHost: a\r\n\r\n');
    const socket = await ask('GET /stream HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\n\r\n');
    assert.deepEqual(link.sockets.map((one) => one.socket), ['/stream']);
    assert.equal(link.connections[0].down, 1000);

    const closed = [page, socket].map((one) => new Promise((resolve) => one.on('close', resolve)));
    link.cut();
    await Promise.all(closed);
  });

  /** Connects through the wire, sends a request and waits for the first bytes that come back. */
  async function ask(request) {
    const socket = connect(link.port, '127.0.0.1').on('error', () => {});
    browsers.push(socket);
    socket.write(request);
    await once(socket, 'data');
    return socket;
  }
});
