// What others see of an inspection over Foxglove's protocol: by Foxglove's own client, decoded by the schemas that the agent
// advertises. No browser takes part.

import assert from 'node:assert/strict';
import { once } from 'node:events';
import { after, before, describe, it } from 'node:test';
import ws from '@foxglove/ws-protocol';
import protobuf from 'protobufjs';
import descriptor from 'protobufjs/ext/descriptor/index.js';
import WebSocket from 'ws';
import { Agent } from './support/agent.mjs';
import { Ply } from './support/ply.mjs';
import { LIMIT } from './support/session.mjs';

const { FoxgloveClient } = ws;

/** Marks that keep a point out of meshes and scenes. */
const LEFT_OUT = 0b1110111;

/** Follows an agent with Foxglove's client, and keeps the messages of each topic, decoded. */
class Follower {
  messages = new Map();
  channels = new Map();

  constructor(url) {
    const socket = new WebSocket(`${url.replace('http', 'ws')}/foxglove`, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
    this.client = new FoxgloveClient({ ws: socket });
    this.client.on('serverInfo', (info) => (this.server = info));
    this.client.on('advertise', (channels) => channels.forEach((channel) => this.#follow(channel)));
    this.client.on('message', ({ subscriptionId, data }) => {
      const { topic, type } = this.channels.get(subscriptionId);
      const message = type.toObject(type.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength)), { defaults: true });
      this.messages.get(topic).push(message);
    });
  }

  #follow({ id, topic, schema, schemaName }) {
    const set = descriptor.FileDescriptorSet.decode(Buffer.from(schema, 'base64'));
    const type = protobuf.Root.fromDescriptor(set).lookupType(schemaName);
    this.messages.set(topic, []);
    this.channels.set(this.client.subscribe(id), { topic, type });
  }

  /** The last message of a topic, once `condition` holds of it. */
  async last(topic, condition = () => true) {
    const deadline = Date.now() + 120_000;
    for (;;) {
      const message = this.messages.get(topic)?.at(-1);
      if (message && condition(message)) return message;
      if (Date.now() > deadline) throw new Error(`waited in vain for ${topic}; last came ${JSON.stringify(message)?.slice(0, 300)}`);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
  }
}

describe('Foxglove', () => {
  let agent, follower, cloud, inspection;
  const ask = async (path) => fetch(`${agent.url}/api/v1/inspections${path}`);
  before(async () => {
    agent = await Agent.start({ pace: 0.5 });
    follower = new Follower(agent.url);
    const finished = ({ message }) => /^finished/.test(message);
    await follower.last('/semascan/log', finished);
    inspection = (await (await ask('')).json()).items[0].id;
    // The files are written when everybody has been told the end.
    let file;
    while (!(file = await ask(`/${inspection}/exports/cloud.ply`)).ok) await new Promise((resolve) => setTimeout(resolve, 100));
    cloud = new Ply(Buffer.from(await file.arrayBuffer()));
  }, LIMIT);
  after(async () => {
    follower?.client.close();
    await agent?.stop();
  }, LIMIT);

  it('is told the growing model, and in the end all of it', LIMIT, async () => {
    assert.match(follower.server.name, /^semascan /);
    const [flags, labels] = [cloud.column('flags'), cloud.column('label')];
    const kept = [...flags.keys()].filter((i) => (flags[i] & LEFT_OUT) === 0);
    const last = await follower.last('/semascan/points', ({ data }) => data.length / 32 === kept.length);
    assert.ok(follower.messages.get('/semascan/points').length >= 2, 'while it grew, too');
    assert.deepEqual([last.frameId, last.pointStride], ['table', 32]);
    const at = Object.fromEntries(last.fields.map(({ name, offset }) => [name, offset]));
    const data = Buffer.from(last.data);
    // The same points in another order: by their sums.
    for (const name of ['x', 'y', 'z']) {
      const column = cloud.column(name);
      const sum = kept.reduce((sum, i) => sum + column[i], 0);
      let told = 0;
      for (let i = 0; i < kept.length; i++) told += data.readFloatLE(32 * i + at[name]);
      assert.ok(Math.abs(told - sum) < 1e-4 * kept.length, `${name}: ${told} and ${sum}`);
    }
    const components = new Map();
    for (let i = 0; i < kept.length; i++) {
      const component = data.readUInt16LE(32 * i + at.component);
      components.set(component, (components.get(component) ?? 0) + 1);
    }
    for (const [component, count] of components) {
      assert.equal(count, kept.filter((i) => labels[i] === component).length, `component ${component}`);
    }
  });

  it('is told where the cameras stood and what they saw', LIMIT, async () => {
    const { items } = await (await ask(`/${inspection}/views`)).json();
    const { transforms } = await follower.last('/tf', ({ transforms }) => transforms.length === items.length + 1);
    for (const { parentFrameId, translation: t, rotation: q } of transforms) {
      assert.equal(parentFrameId, 'table');
      assert.ok(Math.abs(Math.hypot(q.x, q.y, q.z, q.w) - 1) < 1e-9);
      assert.ok(Math.hypot(t.x, t.y, t.z) > 0.05 && Math.hypot(t.x, t.y, t.z) < 2);
    }
    const { entities } = await follower.last('/semascan/cameras', ({ entities }) => entities.length === items.length);
    assert.ok(entities.every(({ lines }) => lines[0].points.length === 16));
    const { data, format } = await follower.last('/semascan/picture');
    assert.equal(format, 'jpeg');
    assert.deepEqual([...data.slice(0, 2)], [0xff, 0xd8]);
  });

  it('is told the findings, and sent the mesh', LIMIT, async () => {
    const { now } = await (await ask(`/${inspection}/findings`)).json();
    const placed = now.filter(({ region }) => region);
    assert.ok(placed.length > 0);
    const { entities } = await follower.last('/semascan/findings', ({ entities }) => entities.length === placed.length);
    assert.deepEqual(entities.map(({ id }) => id).sort(), placed.map(({ id }) => id).sort());
    assert.ok(entities.every(({ lines, texts }) => lines.length > 0 && /mm²/.test(texts[0].text)));
    const { entities: meshes } = await follower.last('/semascan/mesh', ({ entities }) => entities.length === 1);
    assert.equal(Buffer.from(meshes[0].models[0].data.slice(0, 4)).toString(), 'glTF');
  });

  it('that says what is none of the protocol is told so and closed, and the others stay', LIMIT, async () => {
    const { FoxgloveClient: { SUPPORTED_SUBPROTOCOL: protocol } } = ws;
    for (const wrong of ['no JSON', '{"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]}', Buffer.from([1, 2, 3])]) {
      const socket = new WebSocket(`${agent.url.replace('http', 'ws')}/foxglove`, [protocol]);
      await once(socket, 'open');
      socket.send(wrong);
      const [code] = await once(socket, 'close');
      assert.equal(code, 1008, String(wrong));
    }
    const polite = new WebSocket(`${agent.url.replace('http', 'ws')}/foxglove`, [protocol]);
    const said = [];
    polite.on('message', (data) => said.push(String(data)));
    await once(polite, 'open');
    polite.send('{"op":"getParameters"}');
    while (!said.some((text) => text.includes('"status"'))) await once(polite, 'message');
    polite.close();
    assert.equal(follower.client !== undefined && agent.alive, true);
    // A viewer's protocol is not spoken here.
    const refused = new WebSocket(`${agent.url.replace('http', 'ws')}/foxglove`, ['semascan.v1']);
    const [error] = await once(refused, 'error');
    assert.match(String(error), /400/);
  });
});
