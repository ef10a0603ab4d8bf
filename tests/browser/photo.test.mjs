// The photographs as the colours of the mesh: at the place of a camera the picture is that camera's photograph, what hides other
// surface does not colour it, and the mode is chosen, kept and linked to like all others.

import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { after, before, it } from 'node:test';
import { newPage } from './support/chromium.mjs';
import { LIMIT, onEveryBackend } from './support/session.mjs';
import { Viewer } from './support/viewer.mjs';

const { PNG } = createRequire(import.meta.url)('pngjs');

/** Enough views that a choice among them is one. */
const SOURCE = 'virtual:starter-motor?seed=7&views=10&size=320x240&errors=none';

/** Levels that a colour is off which is that of something else. */
const FAR = 40;

/** The viewer's vertical field of view. */
const FIELD = (35 * Math.PI) / 180;

onEveryBackend(
  'photographs as colours',
  (session, backend) => {
    let viewer, page, views;
    before(async () => {
      viewer = await Viewer.open(session.browser, session.agent.url);
      page = viewer.page;
      await viewer.finished();
      views = await page.evaluate(async () => {
        const id = document.getElementById('viewport').dataset.inspection;
        return (await (await fetch(`/api/v1/inspections/${id}/views`)).json()).items;
      });
    }, LIMIT);
    after(() => viewer?.close());


    /** What the page says of the photographs; waits for `state`. */
    const key = async (viewer, state) => {
      const figure = viewer.page.locator(`[data-testid=photo-key][data-state=${state}]`);
      await figure.waitFor({ timeout: 120_000 });
      return figure.evaluate((element) => ({ ...element.dataset, text: element.innerText }));
    };

    /**
     * Looks from the place of a view's camera along its direction, in a colour mode, and takes a picture. In photographs it is
     * taken when they are those of the camera: the first is one of `first`.
     */
    const pictureFrom = async (viewer, view, mode, first = [view.index]) => {
      await viewer.page.evaluate((hash) => (location.hash = hash), `${placeHash(view.pose)}&color=${mode}`);
      await viewer.page.locator(`[data-testid=color-mode-${mode}]:checked`).waitFor({ state: 'attached' });
      const picture = await viewer.picture();
      if (mode !== 'photo') return picture;
      await viewer.page.waitForFunction(
        (first) => {
          const { state, views } = document.querySelector('[data-testid=photo-key]')?.dataset ?? {};
          return state === 'ready' && first.includes(Number(views.split(' ')[0]));
        },
        first,
        { timeout: 60_000 },
      );
      return viewer.picture();
    };

    /** How the picture in photographs and the one in the colours of the points differ from a view's photograph. */
    const errors = async (viewer, view, first) => {
      const part = partOf(await pictureFrom(viewer, view, 'component'));
      const appearance = await pictureFrom(viewer, view, 'appearance');
      const photo = await pictureFrom(viewer, view, 'photo', first);
      const [fx, fy, cx, cy] = (await key(viewer, 'ready')).camera.split(' ').map(Number);
      const truth = { picture: await photographOf(page, view.index), fx, fy, cx, cy };
      const [before, now] = [appearance, photo].map((picture) => errorOf(picture, truth, view.pose, part));
      console.log(
        `${backend}, view ${view.index}: mean colour error over ${part.length} pixels of the part: appearance ` +
          `${before.mean.toFixed(2)}, photographs ${now.mean.toFixed(2)} (${(before.mean / now.mean).toFixed(1)} times less); ` +
          `far off ${(100 * before.far).toFixed(1)} % and ${(100 * now.far).toFixed(1)} %`,
      );
      return { before, now };
    };

    it('is chosen by a key or by its name, makes the mesh, and says how many photographs colour it', LIMIT, async () => {
      await viewer.colorMode('appearance');
      await page.keyboard.press('c');
      const { views: shown, text } = await key(viewer, 'ready');
      assert.ok(await page.getByTestId('color-mode-photo').isChecked());
      const count = shown.split(' ').length;
      assert.ok(count >= 3 && count <= 8, shown);
      assert.match(text, new RegExp(`^Photographs\\s+${count} on the mesh`));
      assert.ok(Number((await viewer.state()).triangles) > 1000, 'the mesh is drawn');
      await viewer.choose('show-points');
      assert.match((await key(viewer, 'points')).text, /They lie on the mesh/);
      await viewer.colorMode('component');
      assert.equal(await page.getByTestId('photo-key').count(), 0);
      await page.keyboard.press('Control+k');
      await page.keyboard.type('colours photo');
      await page.keyboard.press('Enter');
      await key(viewer, 'ready');
      assert.ok(await page.getByTestId('show-mesh').isChecked());
    });

    it('shows at the place of a camera what that camera saw, far better than the colours of the points do', LIMIT, async () => {
      for (const view of views.filter((v) => v.accepted).slice(0, 3)) {
        const { before, now } = await errors(viewer, view);
        assert.ok(3 * now.mean < before.mean, `${now.mean.toFixed(2)} of 255 in place of ${before.mean.toFixed(2)}`);
      }
    });

    it('gives surface that other surface hides from a camera no colour of that', LIMIT, async () => {
      const [own, next] = views.filter((v) => v.accepted);
      const alone = new Viewer(await newPage(session.browser));
      try {
        // Only the photograph of one camera is to be had, and the model is looked at from the place of another.
        await alone.page.addInitScript((index) => {
          const decode = HTMLImageElement.prototype.decode;
          HTMLImageElement.prototype.decode = function () {
            return this.src.includes(`/views/${index}/`) ? decode.call(this) : Promise.reject(new Error('not to be had'));
          };
        }, own.index);
        await alone.page.goto(session.agent.url + placeHash(own.pose));
        await alone.finished();
        await alone.colorMode('photo');
        // Of the others it is found out one after the other.
        await alone.page.waitForFunction(
          (own) => document.querySelector('[data-testid=photo-key][data-state=ready]')?.dataset.views === own,
          String(own.index),
          { timeout: 60_000 },
        );
        const { camera } = await key(alone, 'ready');
        const [fx, fy, cx, cy] = camera.split(' ').map(Number);
        const part = partOf(await pictureFrom(alone, next, 'component'));
        // Its own colours, on the mesh.
        await alone.choose('show-mesh');
        const appearance = await pictureFrom(alone, next, 'appearance');
        const photo = await pictureFrom(alone, next, 'photo', [own.index]);
        const depths = await Promise.all([own, next].map((view) => depthOf(page, view.index)));
        const truth = await photographOf(page, own.index);
        const pixels = sightsOf(photo, part, [own, next], depths, { fx, fy, cx, cy });
        const grey = pixels.hidden.filter(({ i }) => isUnseen(photo.at(i), appearance.at(i))).length / pixels.hidden.length;
        const error = pixels.seen.reduce((sum, { i, u, v }) => sum + colorError(photo.at(i), truth, u, v), 0) / pixels.seen.length;
        console.log(
          `${backend}: of ${pixels.hidden.length} pixels hidden from the camera ${(100 * grey).toFixed(1)} % have no colour of its photograph; ` +
            `mean colour error over ${pixels.seen.length} pixels that it saw ${error.toFixed(2)}`,
        );
        assert.ok(pixels.hidden.length > 150 && pixels.seen.length > 1000);
        assert.ok(grey > 0.9 && error < 8);
        alone.assertNoErrors();
      } finally {
        await alone.close();
      }
    });

    it('outlives a reload, and is where a link leads', LIMIT, async () => {
      await page.goto(session.agent.url);
      await viewer.finished();
      assert.ok(await page.getByTestId('color-mode-photo').isChecked(), 'kept by the page');
      await key(viewer, 'ready');
      assert.ok(Number((await viewer.until((s) => Number(s.triangles) > 0, null, 'the mesh')).triangles) > 1000);
      const follower = await Viewer.open(session.browser, `${session.agent.url}#color=photo`);
      try {
        await follower.finished();
        await key(follower, 'ready');
        follower.assertNoErrors();
      } finally {
        await follower.close();
      }
      viewer.assertNoErrors();
    });
  },
  { agent: { source: SOURCE } },
);

/** Where a camera stands, and a place before it; metres. */
function placeOf({ rotation, translation }) {
  const forward = rotated(rotation, [0, 0, 1]);
  return { eye: translation, target: translation.map((c, k) => c + 0.4 * forward[k]) };
}

/** The fragment of an address that leads there. */
function placeHash(pose) {
  const [eye, target] = Object.values(placeOf(pose)).map((place) => place.map((c) => (1e3 * c).toFixed(3)).join(','));
  return `#eye=${eye}&target=${target}`;
}

/** The photograph of a view, decoded. */
async function photographOf(page, index) {
  const bytes = await page.evaluate(async (index) => {
    const id = document.getElementById('viewport').dataset.inspection;
    return Array.from(new Uint8Array(await (await fetch(`/api/v1/inspections/${id}/views/${index}/color.png`)).arrayBuffer()));
  }, index);
  return PNG.sync.read(Buffer.from(bytes));
}

/** The pixels of a picture in component colours that show a component: coloured, and so are their neighbours. */
function partOf(picture) {
  const { width, height } = picture;
  const coloured = (i) => Math.max(...picture.at(i)) - Math.min(...picture.at(i)) >= 40;
  const pixels = [];
  for (let y = 2; y < height - 2; y++) {
    for (let x = 2; x < width - 2; x++) {
      const i = y * width + x;
      if ([0, -2, 2, -2 * width, 2 * width].every((step) => coloured(i + step))) pixels.push(i);
    }
  }
  return pixels;
}

/** The depths that a view measured, metres. */
async function depthOf(page, index) {
  const { unit, bytes } = await page.evaluate(async (index) => {
    const id = document.getElementById('viewport').dataset.inspection;
    const answer = await fetch(`/api/v1/inspections/${id}/views/${index}/depth.png`);
    return { unit: Number(answer.headers.get('depth-unit-metres')), bytes: Array.from(new Uint8Array(await answer.arrayBuffer())) };
  }, index);
  const { width, height, data } = PNG.sync.read(Buffer.from(bytes), { skipRescale: true });
  return { width, height, at: (u, v) => data[4 * (Math.round(v) * width + Math.round(u))] * unit };
}

/** Where the pixels of a picture from a camera's place lie in the photograph of that camera. */
function* photographed(picture, pixels, pose, { fx, fy, cx, cy }, { width, height }) {
  const { eye, target } = placeOf(pose);
  const forward = unit(target.map((c, i) => c - eye[i]));
  const right = unit(cross(forward, [0, 0, 1]));
  const up = cross(right, forward);
  const focal = picture.height / 2 / Math.tan(FIELD / 2);
  for (const i of pixels) {
    const [x, y] = [(i % picture.width) + 0.5 - picture.width / 2, picture.height / 2 - Math.floor(i / picture.width) - 0.5];
    const [a, b, c] = rotated(inverse(pose.rotation), forward.map((f, k) => f * focal + right[k] * x + up[k] * y));
    const [u, v] = [(fx * a) / c + cx, (fy * b) / c + cy];
    if (u >= 0 && v >= 0 && u < width - 1 && v < height - 1) yield { i, u, v };
  }
}

/**
 * Mean absolute difference, of 255, between a picture from a camera's place and its photograph, over these pixels, and the share
 * of those that are far off.
 */
function errorOf(picture, truth, pose, pixels) {
  let [sum, far, count] = [0, 0, 0];
  for (const { i, u, v } of photographed(picture, pixels, pose, truth, truth.picture)) {
    const error = colorError(picture.at(i), truth.picture, u, v);
    sum += error;
    far += error > FAR;
    count++;
  }
  assert.ok(count > 500, `only ${count} pixels lie in the photograph`);
  return { mean: sum / count, far: far / count };
}

/**
 * The pixels of a picture from the place of the camera `next` that clearly show surface which the camera `own` saw, with their places
 * in its photograph, and those that show surface which it clearly did not: something lies 15 mm or more before it.
 */
function sightsOf(picture, pixels, [own, next], [ownDepth, nextDepth], lens) {
  const found = { seen: [], hidden: [] };
  const around = (depth, u, v) => [-2, 0, 2].flatMap((y) => [-2, 0, 2].map((x) => depth.at(u + x, v + y)));
  const inside = ({ width, height }, u, v) => u > 8 && v > 8 && u < width - 9 && v < height - 9;
  for (const { i, u, v } of photographed(picture, pixels, next.pose, lens, nextDepth)) {
    if (!inside(nextDepth, u, v)) continue;
    const z = nextDepth.at(u, v);
    // Not beside a step: there it is not sure which surface is seen.
    if (around(nextDepth, u, v).some((near) => !(Math.abs(near - z) < 0.006))) continue;
    const local = [((u - lens.cx) / lens.fx) * z, ((v - lens.cy) / lens.fy) * z, z];
    const place = rotated(next.pose.rotation, local).map((c, k) => c + next.pose.translation[k] - own.pose.translation[k]);
    const [a, b, c] = rotated(inverse(own.pose.rotation), place);
    const [p, q] = [(lens.fx * a) / c + lens.cx, (lens.fy * b) / c + lens.cy];
    if (!inside(ownDepth, p, q)) continue;
    const depths = around(ownDepth, p, q);
    if (depths.every((depth) => depth > 0 && depth < c - 0.015)) found.hidden.push({ i });
    if (depths.every((depth) => Math.abs(depth - c) < 0.004)) found.seen.push({ i, u: p, v: q });
  }
  return found;
}

/** Whether a colour is that of surface without a photograph: its own, nearly grey, with dark lines across. */
function isUnseen(rgb, own) {
  const luma = 0.2126 * own[0] + 0.7152 * own[1] + 0.0722 * own[2];
  const grey = own.map((c) => luma + 0.3 * (c - luma));
  const share = Math.max(0.66, Math.min(1.08, rgb.reduce((sum, c) => sum + c, 0) / grey.reduce((sum, c) => sum + c, 1)));
  return rgb.every((c, k) => Math.abs(c - share * grey[k]) < 12);
}

/** Mean absolute difference of a colour and a photograph between its pixels. */
function colorError(rgb, photograph, u, v) {
  return rgb.reduce((sum, c, k) => sum + Math.abs(c - between(photograph, u, v, k)) / 3, 0);
}

/** A channel between the pixels of a picture. */
function between({ width, data }, u, v, channel) {
  const [x, y] = [Math.floor(u), Math.floor(v)];
  const at = (dx, dy) => data[4 * ((y + dy) * width + x + dx) + channel];
  const [s, t] = [u - x, v - y];
  return (1 - t) * ((1 - s) * at(0, 0) + s * at(1, 0)) + t * ((1 - s) * at(0, 1) + s * at(1, 1));
}

function unit(v) {
  const length = Math.hypot(...v);
  return v.map((c) => c / length);
}

function cross(p, q) {
  return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
}

/** A vector turned by a unit quaternion. */
function rotated({ x, y, z, w }, vector) {
  const axis = [x, y, z];
  const once = cross(axis, vector).map((v) => 2 * v);
  const twice = cross(axis, once);
  return vector.map((v, k) => v + w * once[k] + twice[k]);
}

function inverse({ x, y, z, w }) {
  return { x, y, z, w: -w };
}
