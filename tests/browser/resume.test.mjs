// A cut link: the viewer comes back by itself, is sent what it lacks and no more, and ends with the same model as one
// whose link held.

import assert from 'node:assert/strict';
import { after, before, it } from 'node:test';
import { Agent } from './support/agent.mjs';
import { Link } from './support/link.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

/** Seconds a view, so that there is a middle to cut in. */
const PACE = 3;

/** What the messages of two openings, and chunks on their way when the link broke, may cost on top. */
const SLACK = 1.25;

onEveryBackend('a cut link', (session) => {
  let agent, steadyLink, cutLink, steady, cut;

  before(async () => {
    agent = await Agent.start({ pace: PACE });
    [steadyLink, cutLink] = [await Link.to(agent.port), await Link.to(agent.port)];
    steady = await Viewer.open(session.browser, steadyLink.url);
    cut = await Viewer.open(session.browser, cutLink.url);
  }, LIMIT);
  after(async () => {
    await steady?.close();
    await cut?.close();
    await steadyLink?.close();
    await cutLink?.close();
    await agent?.stop();
  }, LIMIT);

  it('resumes by difference and ends with the same model', LIMIT, async () => {
    const { inspection } = await cut.midstream();
    const before = cutLink.sockets.length;
    cutLink.cut();
    // It may be back before anybody looks.
    await cut.until((s) => s.connection !== 'connected' || Number(s.resumed) > 0, null, 'the page to notice the cut', 20_000);
    await cut.until((s) => s.connection === 'connected', null, 'the page to connect again', 30_000);

    const [held, resumed] = [await steady.finished(), await cut.finished()];
    assert.equal(resumed.inspection, inspection, 'still the same inspection');
    assert.equal(resumed.hash, held.hash, 'the same model');
    assert.deepEqual(await cut.points(), await steady.points());
    assert.ok(Number(resumed.resumed) >= 1, `the viewer counts ${resumed.resumed} resumed connections`);

    assert.equal(cutLink.sockets.length, before + 1, 'one new connection');
    const [whole, pieces] = [total(steadyLink), total(cutLink)];
    assert.ok(pieces < SLACK * whole, `${pieces} B in two pieces against ${whole} B in one`);
  });

  it('sends no chunk again once the viewer has them all', LIMIT, async () => {
    const { hash } = await cut.finished();
    const before = cutLink.sockets.length;
    const { resumed } = await cut.state();
    cutLink.cut();
    await cut.until((s, before) => s.connection !== 'connected' || s.resumed !== before, resumed, 'the page to notice the cut', 20_000);
    await cut.until((s) => s.connection === 'connected', null, 'the page to connect again', 30_000);
    await cut.page.waitForTimeout(500);

    assert.equal((await cut.finished()).hash, hash);
    const fresh = await Viewer.open(session.browser, cutLink.url);
    assert.equal((await fresh.finished()).hash, hash, 'a newcomer is sent the same model');
    await fresh.close();
    const [again, newcomer] = cutLink.sockets.slice(before).map((connection) => connection.down);
    assert.ok(again < 0.5 * newcomer, `${again} B to one that held everything, ${newcomer} B to a newcomer`);
  });
});

/** Bytes that came down over every WebSocket of a link. */
function total(link) {
  return link.sockets.reduce((sum, connection) => sum + connection.down, 0);
}
