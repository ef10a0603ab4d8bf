// What most test files need: one agent for all of them, one browser for each graphics backend, and its clean end.

import { after, before, describe } from 'node:test';
import { Agent } from './agent.mjs';
import { BACKENDS, launch } from './chromium.mjs';

/** Longest a single test may take. */
export const LIMIT = { timeout: 240_000 };

/**
 * Runs `tests(session, backend)` for each graphics backend; `session.browser` is a running browser and, if `agent`
 * says how to start one (options of [`Agent.start`]), `session.agent` an agent that all backends share. What looks at words alone
 * is the same on all `backends`, and names one.
 */
export function onEveryBackend(title, tests, { agent, backends = BACKENDS } = {}) {
  describe(title, () => {
    const shared = {};
    before(async () => {
      if (agent) shared.agent = await Agent.start(agent);
    }, LIMIT);
    after(() => shared.agent?.stop(), LIMIT);
    for (const backend of backends) {
      describe(backend, () => {
        const session = Object.create(shared);
        before(async () => {
          session.browser = await launch(backend);
        }, LIMIT);
        after(() => session.browser?.close(), LIMIT);
        tests(session, backend);
      });
    }
  });
}
