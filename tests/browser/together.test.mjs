// Two people review the same inspection at once, one of them in two tabs, while links are cut and the agent is killed: nothing that
// somebody signed is lost or taken in twice, and in the end everybody sees what the agent says.
//
// `SEMASCAN_TEST_ACTIONS` and `SEMASCAN_TEST_CUTS` say how many there are, `SEMASCAN_TEST_SEED` which.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, it } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';
import { Agent, BINARY, SOURCE } from './support/agent.mjs';
import { Chance } from './support/chance.mjs';
import { Link } from './support/link.mjs';
import { onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const ACTIONS = Number(process.env.SEMASCAN_TEST_ACTIONS ?? 16);
const CUTS = Number(process.env.SEMASCAN_TEST_CUTS ?? 5);
const SEED = Number(process.env.SEMASCAN_TEST_SEED ?? Date.now() % 1_000_000);

/** Longest that a test may take: actions are made by hand, and a cut may cost a start of the agent. */
const LIMIT = { timeout: 120_000 + 15_000 * ACTIONS + 30_000 * CUTS };
/** Longest wait for what needs the agent: it may be on its way up, with everything to be read and drawn again. */
const PATIENCE = { timeout: 90_000 };
/** Kinds of cuts: every connection of a person reset; their browser offline; the agent killed; the page loaded again. */
const KINDS = ['reset', 'reset', 'offline', 'kill', 'reload'];
const KEYS = { accept: 'y', rework: 'r', reject: 'x', comment: 'i' };

onEveryBackend(
  'two people at once',
  (session) => {
    const chance = new Chance(SEED);
    const data = mkdtempSync(join(tmpdir(), 'semascan-together-'));
    /** What was signed, by its reason, which is different each time; names of reviews that were sent. */
    const signed = [];
    const refused = [];
    const sent = new Set();
    /** Clicks of the brush, by the reason that they were signed with. */
    const clicks = new Map();
    let agent, id, kim, lee;

    before(async () => {
      console.log(`# ${ACTIONS} actions, ${CUTS} cuts, SEMASCAN_TEST_SEED=${SEED}`);
      const inspected = spawnSync(BINARY, ['inspect', SOURCE, '--data', data], { encoding: 'utf8' });
      assert.equal(inspected.status, 0, inspected.stderr);
      agent = await Agent.start({ source: null, args: ['--data', data] });
      id = (await (await fetch(`${agent.url}/api/v1/inspections`)).json()).items[0].id;
      kim = await Person.arrive('Kim', 2);
      lee = await Person.arrive('Lee', 1);
    }, LIMIT);
    after(async () => {
      await kim?.leave();
      await lee?.leave();
      await agent?.stop();
      rmSync(data, { recursive: true, force: true });
    }, LIMIT);

    /** What the agent says of the inspection. */
    const ask = async (path) => (await fetch(`${agent.url}/api/v1/inspections/${id}/${path}`)).json();
    const log = async () => {
      const items = [];
      for (let after = 0; after !== undefined; ) {
        const page = await ask(`reviews?limit=500&after=${after}`);
        items.push(...page.items);
        after = page.next;
      }
      return items.map((item) => item.review);
    };

    /** Kills the agent and, after a while, starts it again where it was. One after the other. */
    let killed = Promise.resolve();
    const kill = (down) =>
      (killed = killed.then(async () => {
        await agent.kill();
        await pause(down);
        agent = await Agent.start({ source: null, port: agent.port, args: ['--data', data] });
      }));

    /** A person with a browser of their own and a wire to the agent. */
    class Person {
      static async arrive(name, tabs) {
        const person = new Person();
        person.name = name;
        person.link = await Link.to(agent.port);
        const address = `${person.link.url}/?inspection=${id}&speed=1000`;
        const first = await Viewer.open(session.browser, address);
        person.tabs = [first];
        while (person.tabs.length < tabs) {
          const page = await first.page.context().newPage();
          person.tabs.push(new Viewer(page));
          await page.goto(address);
        }
        for (const tab of person.tabs) {
          tab.page.on('request', (request) => {
            if (request.method() === 'POST' && request.url().endsWith('/reviews')) sent.add(request.postDataJSON().id);
          });
          // What is refused is lost, and the page says so: nothing here gives a reason for that.
          tab.page.on('response', async (response) => {
            const request = response.request();
            if (request.method() !== 'POST' || !request.url().endsWith('/reviews') || response.status() < 400) return;
            const said = await response.text().catch((error) => String(error));
            refused.push(`${request.postDataJSON().reason}: ${response.status()} ${said.slice(0, 300)}`);
          });
          await ready(tab);
        }
        return person;
      }

      async leave() {
        await this.tabs[0].close();
        await this.link.close();
      }

      /** Cuts something at once, and mends it. */
      async cut(kind, tab) {
        const context = tab.page.context();
        switch (kind) {
          case 'reset':
            return this.link.cut();
          case 'offline':
            await context.setOffline(true);
            this.link.cut();
            await pause(200 + chance.below(1500));
            return context.setOffline(false);
          case 'kill':
            return kill(chance.below(1500));
        }
      }

      /** Says something of a finding or the part, as `number` of all that is said; `cuts` happen meanwhile. */
      async act(number, cuts) {
        const tab = chance.of(this.tabs);
        const about = chance.next() < 0.15 ? null : chance.below(5);
        const how = chance.of(['key', 'key', 'key', 'button', 'button', 'class', 'brush']);
        const reason = `${this.name} ${number}`;
        const wrecks = cuts.filter((kind) => kind !== 'reload').map((kind) => pause(chance.below(900)).then(() => this.cut(kind, tab)));
        await choose(tab, how === 'class' || how === 'brush' ? (about ?? 0) : about);
        await (how === 'brush' ? this.paint(tab, reason) : this.rule(tab, how, reason));
        signed.push(reason);
        if (cuts.includes('reload')) {
          await Promise.all(wrecks);
          await loadAgain(tab);
        }
        return wrecks;
      }

      /** Decides about what is chosen. */
      async rule({ page, canvas }, how, reason) {
        const form = page.getByTestId('draft-form');
        if (how === 'class') {
          const choice = page.getByTestId('finding-class');
          await choice.locator('option').nth(2).waitFor({ state: 'attached', ...PATIENCE });
          const is = await choice.inputValue();
          const names = await choice.locator('option').evaluateAll((options) => options.map((option) => option.value));
          await choice.selectOption(chance.of(names.filter((name) => name && name !== is)));
        } else {
          const [ruling, key] = chance.of(Object.entries(KEYS));
          if (how === 'button') {
            await page.getByTestId(`ruling-${ruling}`).click();
          } else {
            await canvas.focus();
            await page.keyboard.press(key);
          }
        }
        await form.waitFor();
        await this.sign(page, 'draft', reason);
        await page.keyboard.press('Enter');
        await form.waitFor({ state: 'detached' });
      }

      /** Paints a dot where the view looks, which is at the chosen finding. */
      async paint(tab, reason) {
        const { page } = tab;
        const panel = page.getByTestId('correct');
        await page.getByTestId('correct-brush').click();
        const classes = page.getByTestId('correct-class').locator('option');
        await classes.first().waitFor({ state: 'attached', ...PATIENCE });
        await page.getByTestId('correct-class').selectOption(chance.of(await classes.evaluateAll((options) => options.map((o) => o.value))));
        const deadline = Date.now() + PATIENCE.timeout;
        while ((await panel.getAttribute('data-marks')) === '0') {
          assert.ok(Date.now() < deadline, 'nothing can be painted');
          // A model that comes again has nothing to be painted yet. All clicks may be picked in the end.
          const box = await tab.canvas.boundingBox();
          clicks.set(reason, (clicks.get(reason) ?? 0) + 1);
          await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
          // Where a click lies is picked, which may take a while: a mark of it must not come after the signature.
          do await pause(700);
          while ((await tab.state()).drawing === 'true' && Date.now() < deadline);
        }
        while ((await panel.getAttribute('data-marks')) !== '1') await page.getByTestId('correct-undo').click();
        await this.sign(page, 'correct', reason);
        await page.getByTestId('correct-sign').click();
        // A mark of a click that was picked late came after the signature, and is taken back: its form is empty.
        for (const end = Date.now() + PATIENCE.timeout; (await panel.getAttribute('data-marks')) !== '0'; await pause(1000)) {
          assert.ok(Date.now() < end, 'marks that are signed stay');
          const field = page.getByTestId('correct-reason');
          if ((await field.count()) && (await field.inputValue()) === '') await page.getByTestId('correct-undo').click();
        }
        await page.getByTestId('correct-brush').click();
      }

      async sign(page, form, reason) {
        await page.getByTestId(`${form}-reason`).fill(reason);
        const name = page.getByTestId(`${form}-person`);
        if ((await name.inputValue()) === '') await name.fill(this.name);
        await page.getByTestId(`${form}-reason`).focus();
      }
    }

    /** Waits until there is something to decide about. */
    const ready = async (tab, limit) => {
      await tab.finished(limit);
      await tab.page.getByTestId('finding-1').waitFor(PATIENCE);
      await tab.page.getByTestId('correct').waitFor(PATIENCE);
    };

    /** Loads a page again until it is there: the other person's cuts may take a part of it, which the page says. */
    const loadAgain = async (tab) => {
      for (const deadline = Date.now() + 3 * PATIENCE.timeout; ; await pause(500)) {
        await killed;
        const failed = await tab.page.reload().then(() => ready(tab, PATIENCE.timeout / 2)).then(() => null, (error) => error);
        if (!failed) return;
        if (Date.now() > deadline) throw failed;
      }
    };

    /** Chooses a finding by its row, or the part. */
    const choose = async ({ page }, about) => {
      const pressed = page.locator('.finding[aria-pressed=true]');
      if (about === null) {
        if (await pressed.count()) await pressed.first().click();
        await page.getByTestId('ruling-title').filter({ hasText: 'the part' }).waitFor();
      } else {
        const row = page.getByTestId(`finding-${about + 1}`);
        const detail = page.getByTestId('finding-detail');
        // A page that hears of the model anew between two clicks forgets what was chosen: a person chooses again.
        for (const deadline = Date.now() + PATIENCE.timeout; !(await detail.isVisible()); await pause(250)) {
          assert.ok(Date.now() < deadline, 'the finding cannot be chosen');
          if ((await row.getAttribute('aria-pressed')) !== 'true') await row.click();
        }
      }
    };

    /** Waits until nothing waits for the agent on any page. */
    const arrived = async () => {
      for (const { page } of [...kim.tabs, ...lee.tabs]) {
        await page.waitForFunction(() => document.querySelector('[data-testid=review]')?.dataset.unsent === '0', null, PATIENCE);
      }
    };

    /** What a page shows of the findings and the part. */
    const shown = ({ page }) =>
      page.evaluate(() => {
        const of = (element) => element?.dataset.decision ?? null;
        const rows = [...document.querySelectorAll('.finding')].map((row) => of(row.querySelector('.decision')));
        return [of(document.querySelector('[data-testid=verdict]')), ...rows];
      });

    /** The same by what the agent says. */
    const said = async () => {
      const [{ now }, verdict] = [await ask('findings'), await ask('verdict')];
      const order = ['accept', 'rework', 'person', 'reject'];
      const of = (finding) => {
        const subject = verdict.subjects.find((state) => state.subject.finding === finding.id);
        if (subject?.conflict?.length) return 'person';
        const lines = (verdict.now?.lines ?? []).filter((line) => line.findings.includes(finding.id));
        return subject?.decision ?? order[Math.max(-1, ...lines.map((line) => order.indexOf(line.decision)))] ?? null;
      };
      return [verdict.decision ?? null, ...now.map(of)];
    };

    it('keep what they write while the agent is killed and comes back, and see that it is away', LIMIT, async () => {
      const [tab, other] = kim.tabs;
      await choose(tab, 1);
      await tab.page.getByTestId('ruling-rework').click();
      await tab.page.getByTestId('draft-form').waitFor();
      await kim.sign(tab.page, 'draft', 'before the cut');
      await agent.kill();
      await tab.until((s) => s.connection !== 'connected', null, 'the page to notice', 20_000);
      await tab.page.getByTestId('banner').waitFor();
      // Another tab signs while nobody answers.
      await choose(other, 0);
      await other.page.getByTestId('ruling-comment').click();
      await kim.sign(other.page, 'draft', 'while it was away');
      await other.page.keyboard.press('Enter');
      await other.page.getByTestId('unsent').waitFor();
      agent = await Agent.start({ source: null, port: agent.port, args: ['--data', data] });
      await ready(tab);
      assert.equal(await tab.page.getByTestId('draft-reason').inputValue(), 'before the cut');
      await tab.page.keyboard.press('Enter');
      signed.push('before the cut', 'while it was away');
      await arrived();
    });

    it('lose nothing in two tabs that are both loaded again before it arrived', LIMIT, async () => {
      const context = kim.tabs[0].page.context();
      const refuse = (route) => (route.request().method() === 'POST' ? route.abort() : route.continue());
      await context.route('**/api/v1/inspections/*/reviews', refuse);
      for (const [place, tab] of kim.tabs.entries()) {
        await choose(tab, place);
        await tab.page.getByTestId('ruling-comment').click();
        await kim.sign(tab.page, 'draft', `in tab ${place}`);
        await tab.page.keyboard.press('Enter');
        await tab.page.getByTestId('unsent').waitFor();
        signed.push(`in tab ${place}`);
      }
      await Promise.all(kim.tabs.map(({ page }) => page.reload()));
      await Promise.all(kim.tabs.map((tab) => ready(tab)));
      await context.unroute('**/api/v1/inspections/*/reviews');
      await arrived();
      const reasons = (await log()).map((review) => review.reason);
      assert.deepEqual(reasons.toSorted(), signed.toSorted());
    });

    it('come to the same, whatever is cut', LIMIT, async () => {
      const people = [kim, lee];
      const cuts = Array.from({ length: ACTIONS }, () => []);
      for (let n = 0; n < CUTS; n++) chance.of(cuts).push(KINDS[n % KINDS.length]);
      const wrecks = [];
      const began = Date.now();
      // Both at once: each takes the next action as soon as their last one is signed.
      let next = 0;
      const work = async (person) => {
        while (next < ACTIONS) {
          const number = next++;
          wrecks.push(...(await person.act(number, cuts[number])));
        }
      };
      const done = await Promise.allSettled(people.map((person) => work(person).finally(() => (next = ACTIONS))));
      await Promise.all(wrecks);
      await killed;
      for (const { reason } of done) assert.ifError(reason);
      await arrived();
      console.log(`# ${ACTIONS} actions and ${CUTS} cuts in ${((Date.now() - began) / 1000).toFixed(0)} s`);

      assert.deepEqual(refused.filter((text) => !/: (408|429|50[2347]) /.test(text)), [], 'refused');
      const reviews = await log();
      // What is said of two marks at once is said of each.
      const byReason = new Map();
      for (const review of reviews) byReason.set(review.reason, [...(byReason.get(review.reason) ?? []), review]);
      assert.deepEqual([...byReason.keys()].toSorted(), signed.toSorted(), 'everything that was signed, and nothing else');
      const twice = [...byReason.values()].filter((of) => of.length > 1);
      for (const of of twice) {
        const kinds = of.map(({ action }) => action.type).join(', ');
        assert.ok(of.every(({ action }) => action.type === 'relabel'), `${of[0].reason} is said ${of.length} times: ${kinds}`);
        assert.ok(of.length <= clicks.get(of[0].reason), `${of[0].reason}: ${of.length} marks of ${clicks.get(of[0].reason)} clicks`);
      }
      assert.equal(new Set(reviews.map((review) => review.id)).size, reviews.length, 'each has its name');
      assert.deepEqual(reviews.map((review) => review.id).toSorted(), [...sent].toSorted(), 'what was sent, and nothing else');

      for (const { page } of [...kim.tabs, ...lee.tabs]) {
        const all = page.getByTestId('findings-all');
        if ((await all.count()) && (await all.getAttribute('aria-expanded')) !== 'true') await all.click();
      }
      const truth = await said();
      for (const tab of [...kim.tabs, ...lee.tabs]) {
        const deadline = Date.now() + PATIENCE.timeout;
        let seen;
        do seen = await shown(tab);
        while (JSON.stringify(seen) !== JSON.stringify(truth) && Date.now() < deadline && (await pause(200), true));
        assert.deepEqual(seen, truth);
      }
      const counts = new Map();
      for (const { action } of reviews) counts.set(action.type, (counts.get(action.type) ?? 0) + 1);
      console.log(`# ${[...counts].map(([type, count]) => `${count} ${type}`).join(', ')}; ${truth.length - 1} findings`);
    });

    it('see where the others point, and not their own pointer', LIMIT, async () => {
      const [from, to] = [kim.tabs[0], lee.tabs[0]];
      await choose(to, 0);
      const picked = async () => (await from.page.getByTestId('picked-ring').getAttribute('data-place', PATIENCE)).split(' ').map(Number);
      // Kim's other tab is somebody else to the page: the mark that is meant is where this tab points.
      const seen = async ({ page }, place) => {
        const marks = await page
          .getByTestId('other')
          .evaluateAll((marks) => marks.map((mark) => ({ ...mark.dataset, text: mark.textContent })));
        const ofKim = marks.filter((mark) => /Kim/.test(mark.text));
        return ofKim.find((mark) => Math.hypot(...mark.place.split(' ').map((c, k) => c - place[k])) < 1e-6);
      };
      // A finding that is chosen is picked: its place is pointed at. Who was alone a moment ago is silent for a while.
      let mark;
      for (const deadline = Date.now() + PATIENCE.timeout; !mark; mark = await seen(to, await picked())) {
        assert.ok(Date.now() < deadline, 'nobody is seen to point');
        await choose(from, null);
        await choose(from, 0);
        await pause(1000);
      }
      assert.equal(await seen(from, await picked()), undefined, 'their own');
      const name = mark.anchor.replace('other-', '');
      await to.page.locator(`[data-anchor="${mark.anchor}"]`).waitFor({ state: 'detached', ...PATIENCE });
      const file = await fetch(`${agent.url}/api/v1/inspections/${id}/inspection.semascan`);
      assert.ok(file.ok && !Buffer.from(await file.arrayBuffer()).includes(name), 'it is kept nowhere');
    });

    it('leave a log that nobody changed', LIMIT, async () => {
      await agent.stop();
      const verified = spawnSync(BINARY, ['audit', 'verify', '--data', data, '--json'], { encoding: 'utf8' });
      assert.equal(verified.status, 0, verified.stderr);
      assert.equal(JSON.parse(verified.stdout).entries, sent.size);
    });
  },
  { backends: ['webgl2'] },
);
