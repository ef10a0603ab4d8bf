// Golden pictures: one for each backend and name, in `golden/`. `UPDATE_SNAPSHOTS=1` writes them anew.

import assert from 'node:assert/strict';
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { Picture } from './pixels.mjs';

const GOLDEN = new URL('../golden/', import.meta.url);
const OUT = new URL('../out/', import.meta.url);

/** Share of pixels that may differ visibly: versions of a rasterizer differ along the edges of points. */
const TOLERANCE = 0.01;

/** Compares a picture with its golden one; a differing picture is kept in `out/`. */
export async function assertGolden(picture, name) {
  const file = new URL(`${name}.png`, GOLDEN);
  if (process.env.UPDATE_SNAPSHOTS === '1') {
    await mkdir(GOLDEN, { recursive: true });
    await writeFile(file, picture.png);
    return;
  }
  const golden = new Picture(
    await readFile(file).catch(() => assert.fail(`no golden/${name}.png: run with UPDATE_SNAPSHOTS=1 and look at it`)),
  );
  const difference = picture.difference(golden);
  if (difference > TOLERANCE) {
    await mkdir(OUT, { recursive: true });
    await writeFile(new URL(`${name}.png`, OUT), picture.png);
    const percent = (100 * difference).toFixed(2);
    assert.fail(`${percent} % of the pixels differ from golden/${name}.png; the new picture is out/${name}.png`);
  }
}
