// Starts the real agent on a free port of the loopback interface and ends it again, gently or not.

import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { fileURLToPath } from 'node:url';

/** The binary under test; `cargo xtask test` builds it and says where it is. */
export const BINARY =
  process.env.SEMASCAN_AGENT ?? fileURLToPath(new URL('../../../target/debug/semascan', import.meta.url));

/** The part that every test watches: small pictures and few views, because a software rasterizer draws them. */
export const SOURCE = 'virtual:starter-motor?seed=7&views=5&size=320x240&errors=none';

/** How long an agent may take until it listens. */
const START_LIMIT_MS = 60_000;

const running = new Set();
process.on('exit', () => running.forEach((child) => child.kill('SIGKILL')));

/** One running agent. */
export class Agent {
  #child;
  #log = '';

  constructor(child) {
    this.#child = child;
    running.add(child);
    child.on('exit', () => running.delete(child));
    child.on('error', (error) => (this.#log += `cannot start ${BINARY}: ${error.message}`));
    for (const stream of [child.stdout, child.stderr]) {
      stream.setEncoding('utf8').on('data', (text) => (this.#log += text));
    }
  }

  /**
   * Starts `semascan demo`, or `semascan serve` if trained networks are to label the views or nothing is to be inspected
   * (`source` null), and waits until it listens.
   * @param {{source?: string|null, port?: number, pace?: number, voxel?: number, models?: string}} options `port` 0 takes a
   *   free one; `pace` is the shortest time of a view in seconds, so that a test can act in the middle of an inspection;
   *   `voxel` is in millimetres; `models` names networks; `args` are passed on as they are
   */
  static async start({ source = SOURCE, port = 0, pace = 0, voxel, models, args: more = [] } = {}) {
    const networks = models ? ['--labels', 'network', '--models', models] : [];
    const command = models || source === null ? ['serve', ...networks] : ['demo', '--no-open'];
    const args = [...command, '--port', String(port), '--pace', String(pace), ...more];
    if (source !== null) args.push('--source', source);
    if (voxel !== undefined) args.push('--voxel', String(voxel));
    const agent = new Agent(spawn(BINARY, args, { stdio: ['ignore', 'pipe', 'pipe'] }));
    agent.url = await agent.#listening();
    agent.port = Number(new URL(agent.url).port);
    return agent;
  }

  /** Everything the agent has said. */
  get log() {
    return this.#log;
  }

  /** Whether the process has not ended. */
  get alive() {
    return this.#child.pid !== undefined && this.#child.exitCode === null && this.#child.signalCode === null;
  }

  /** Ends the agent as a power cut does: nothing is flushed, no socket is closed in good order. */
  async kill() {
    await this.#end('SIGKILL');
  }

  /** Asks the agent to end. */
  async stop() {
    await this.#end('SIGTERM');
  }

  async #end(signal) {
    if (this.alive) {
      const ended = once(this.#child, 'exit');
      this.#child.kill(signal);
      await ended;
    }
  }

  async #listening() {
    const deadline = Date.now() + START_LIMIT_MS;
    for (;;) {
      await new Promise((resolve) => setTimeout(resolve, 20));
      const found = this.#log.match(/listening on (http:\/\/\S+?)\/?\s/);
      if (found) return found[1];
      if (!this.alive) throw new Error(`the agent ended before it listened:\n${this.#log}`);
      if (Date.now() > deadline) throw new Error(`the agent does not listen:\n${this.#log}`);
    }
  }
}
