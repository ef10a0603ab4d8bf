// A stranger on the wire between agent and browser: what the agent sends passes, and what a test makes of it follows.

import { createServer, connect } from 'node:net';
import { once } from 'node:events';

const BINARY = 2;

/** A TCP relay that sees every message that goes to the browser and may send more. */
export class HostileLink {
  #server;
  #sockets = new Set();

  /**
   * Starts a relay to the agent on `port`. `follow(message, send)` sees each binary message to the browser after it has been
   * passed on; `send(bytes)` sends another one and resolves once there is room for the next.
   */
  static async to(port, follow) {
    const link = new HostileLink();
    link.#server = createServer((browser) => link.#relay(browser, port, follow));
    link.#server.listen(0, '127.0.0.1');
    await once(link.#server, 'listening');
    link.url = `http://127.0.0.1:${link.#server.address().port}`;
    return link;
  }

  async close() {
    this.#sockets.forEach((socket) => socket.destroy());
    this.#server.close();
    await once(this.#server, 'close');
  }

  #relay(browser, port, follow) {
    const agent = connect(port, '127.0.0.1');
    for (const [one, other] of [[browser, agent], [agent, browser]]) {
      this.#sockets.add(one);
      // A page that ends while it is being sent to is what tests cause on purpose.
      one.on('error', () => other.destroy());
      one.on('close', () => {
        this.#sockets.delete(one);
        other.destroy();
      });
    }
    browser.once('data', (request) => {
      agent.write(request);
      if (/upgrade: websocket/i.test(request.toString('latin1'))) {
        browser.pipe(agent);
        passMessages(agent, browser, follow).catch(() => browser.destroy());
      } else {
        browser.pipe(agent).pipe(browser);
      }
    });
  }
}

/** Passes the answer to an upgrade and then message by message. */
async function passMessages(agent, browser, follow) {
  const send = async (bytes) => {
    if (!browser.write(frame(bytes))) await once(browser, 'drain');
  };
  let [held, isOpen] = [Buffer.alloc(0), false];
  for await (const bytes of agent) {
    held = Buffer.concat([held, bytes]);
    if (!isOpen) {
      const end = held.indexOf('\r\n\r\n');
      if (end < 0) continue;
      browser.write(held.subarray(0, end + 4));
      [held, isOpen] = [held.subarray(end + 4), true];
    }
    for (let size = frameSize(held); size !== null && size.whole <= held.length; size = frameSize(held)) {
      const [whole, kind] = [held.subarray(0, size.whole), held[0] & 0x0f];
      held = held.subarray(size.whole);
      browser.write(whole);
      if (kind === BINARY) await follow(whole.subarray(size.head), send);
    }
  }
}

/** Length of the head of the frame that `bytes` begin with, and of the whole frame; `null` if the head is not there yet. */
function frameSize(bytes) {
  if (bytes.length < 2) return null;
  const short = bytes[1] & 0x7f;
  const head = { 126: 4, 127: 10 }[short] ?? 2;
  if (bytes.length < head) return null;
  const payload = head === 4 ? bytes.readUInt16BE(2) : head === 10 ? Number(bytes.readBigUInt64BE(2)) : short;
  return { head, whole: head + payload };
}

/** A binary message as one frame of a server; its length must be written in as few bytes as it can be (RFC 6455, 5.2). */
function frame(bytes) {
  const head = Buffer.alloc(bytes.length < 126 ? 2 : bytes.length < 65536 ? 4 : 10);
  head[0] = 0x80 | BINARY;
  head[1] = { 2: bytes.length, 4: 126, 10: 127 }[head.length];
  if (head.length === 4) head.writeUInt16BE(bytes.length, 2);
  if (head.length === 10) head.writeBigUInt64BE(BigInt(bytes.length), 2);
  return Buffer.concat([head, bytes]);
}
