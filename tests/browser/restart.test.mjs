// An agent that dies and comes back has begun a new inspection: the viewer drops the old model and ends with the new.

import assert from 'node:assert/strict';
import { after, before, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** Seconds a view, so that the agent can be killed in the middle of its inspection. */
const PACE = 1;

onEveryBackend('a restarted agent', (session) => {
  let agent, viewer;
  before(async () => {
    agent = await Agent.start({ pace: PACE });
    viewer = await Viewer.open(session.browser, agent.url);
  }, LIMIT);
  after(async () => {
    await viewer?.close();
    await agent?.stop();
  }, LIMIT);

  it('is met with an empty model that ends like any other of the same seed', LIMIT, async () => {
    const first = await viewer.midstream();
    await agent.kill();
    await viewer.until((s) => s.connection !== 'connected', null, 'the page to notice', 20_000);
    assert.ok(Number((await viewer.state()).points) > 0, 'what was captured stays in view while the agent is away');

    agent = await Agent.start({ pace: PACE, port: agent.port });
    const second = await viewer.until((s, old) => s.inspection && s.inspection !== old, first.inspection, 'a new inspection');
    assert.notEqual(second.phase, 'finished');

    const newcomer = await Viewer.open(session.browser, agent.url);
    const [ended, uninterrupted] = [await viewer.finished(), await newcomer.finished()];
    assert.equal(ended.inspection, uninterrupted.inspection);
    assert.equal(ended.hash, uninterrupted.hash, 'nothing of the first inspection is left');
    assert.deepEqual(await viewer.points(), await newcomer.points());
    await newcomer.close();
  });
});
