// A wire between browser and agent that can be cut and that counts what flows through it: whether a viewer really
// resumes by difference shows in bytes, not in what the viewer says about itself.

import { createServer, connect } from 'node:net';
import { once } from 'node:events';

/** One connection through the wire. */
class Connection {
  /** Bytes from the agent to the browser. */
  down = 0;
  /** Path of the WebSocket; `null` for plain HTTP. */
  socket = null;
}

/** A TCP relay on a free port of the loopback interface. */
export class Link {
  #server;
  #pairs = new Set();
  /** Every connection so far, oldest first. */
  connections = [];

  /** Starts a relay to the agent on `port`. */
  static async to(port) {
    const link = new Link();
    link.#server = createServer((browser) => link.#relay(browser, port));
    link.#server.listen(0, '127.0.0.1');
    await once(link.#server, 'listening');
    link.port = link.#server.address().port;
    link.url = `http://127.0.0.1:${link.port}`;
    return link;
  }

  /** The WebSocket connections so far, oldest first. */
  get sockets() {
    return this.connections.filter((connection) => connection.socket !== null);
  }

  /** Cuts every connection, as a pulled cable does once the kernel notices; new ones are let through. */
  cut() {
    for (const pair of this.#pairs) pair.forEach((socket) => socket.resetAndDestroy());
    this.#pairs.clear();
  }

  async close() {
    this.cut();
    this.#server.close();
    await once(this.#server, 'close');
  }

  #relay(browser, port) {
    const connection = new Connection();
    this.connections.push(connection);
    const agent = connect(port, '127.0.0.1');
    const pair = [browser, agent];
    this.#pairs.add(pair);
    browser.on('data', (bytes) => {
      const upgrade = bytes.toString('latin1').match(/^GET (\S+) HTTP\/1\.1\r\n[^]*?upgrade: websocket/i);
      if (upgrade) connection.socket = upgrade[1];
    });
    agent.on('data', (bytes) => (connection.down += bytes.length));
    browser.pipe(agent).pipe(browser);
    for (const [one, other] of [pair, [agent, browser]]) {
      // A reset is what tests cause on purpose.
      one.on('error', () => other.destroy());
      // One end that is left open can still be cut: the relay does not close while there is one.
      one.on('close', () => pair.every((socket) => socket.destroyed) && this.#pairs.delete(pair));
    }
  }
}
