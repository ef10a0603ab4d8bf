// Chunks that no agent would send: without end, or of a model of any size. A test passes them to a page over a `HostileLink`.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';

/** What makes the chunks; `cargo xtask test` builds it and says where it is. */
export const ENDLESS = process.env.SEMASCAN_ENDLESS_STREAM;
/** Tags of field 16 of a message, a chunk, and of field 1 of that, its epoch (`shared/protocol/proto`). */
const [CHUNK, EPOCH] = [Buffer.from([0x82, 0x01]), 0x08];

/** Sends chunks of so many points once the agent has sent its first one. */
export class Sender {
  chunks = 0;
  bytes = 0;
  #options;
  #child;

  /** Chunks of so many points on voxels of so many metres; so many chunks, or without end. */
  constructor({ points, voxel = 0.001, chunks }) {
    this.#options = [points, voxel, ...(chunks === undefined ? [] : [chunks])].map(String);
  }

  async follow(message, send) {
    if (this.#child || !message.subarray(0, 2).equals(CHUNK)) return;
    this.#child = spawn(ENDLESS, [String(epoch(message)), ...this.#options], { stdio: ['ignore', 'pipe', 'inherit'] });
    let held = Buffer.alloc(0);
    for await (const bytes of this.#child.stdout) {
      held = Buffer.concat([held, bytes]);
      while (held.length >= 4 && held.length >= 4 + held.readUInt32LE()) {
        const end = 4 + held.readUInt32LE();
        await send(held.subarray(4, end));
        [this.chunks, this.bytes] = [this.chunks + 1, this.bytes + end];
        held = held.subarray(end);
      }
    }
  }

  stop() {
    this.#child?.kill('SIGKILL');
  }
}

/** The epoch of a chunk: the first field of the message in the message. */
function epoch(message) {
  let at = CHUNK.length;
  while (message[at++] & 0x80);
  assert.equal(message[at], EPOCH, 'a chunk begins with its epoch');
  return message[at + 1];
}
