// Pictures and what can be counted in them.

import { PNG } from 'pngjs';

/** Largest difference in a channel at which two pixels still count as the same: rasterizers differ in rounding. */
const SAME = 24;

/** Least distance from the background, in any channel, of a pixel that something was drawn on. */
const DRAWN = 28;

/** A decoded picture. */
export class Picture {
  constructor(png) {
    this.png = png;
    const { width, height, data } = PNG.sync.read(png);
    Object.assign(this, { width, height, data });
  }

  get pixels() {
    return this.width * this.height;
  }

  /** Red, green, blue of pixel `i`, counted row by row. */
  at(i) {
    return [this.data[4 * i], this.data[4 * i + 1], this.data[4 * i + 2]];
  }

  equals(other) {
    return this.width === other.width && this.height === other.height && Buffer.compare(this.data, other.data) === 0;
  }

  /** Share of pixels that differ visibly from `other`'s; 1 if the sizes differ. */
  difference(other) {
    if (this.width !== other.width || this.height !== other.height) return 1;
    let differing = 0;
    for (let i = 0; i < this.pixels; i++) differing += farthest(this.at(i), other.at(i)) > SAME;
    return differing / this.pixels;
  }

  /**
   * Number of pixels that belong to the model: unlike the background at the same height, which is taken from the
   * picture's left edge so that a vertical gradient does not count.
   */
  drawn() {
    let count = 0;
    this.#eachDrawn(() => count++);
    return count;
  }

  /** Number of drawn pixels with a visible colour: channels that differ by at least a tenth of the scale. */
  coloured() {
    let count = 0;
    this.#eachDrawn((rgb) => (count += Math.max(...rgb) - Math.min(...rgb) >= 26));
    return count;
  }

  /**
   * Number of drawn pixels of each of `colors` (`[[r, g, b], ..]`): shading changes how bright a colour is and not its
   * hue, so a pixel counts for the colour of nearest hue, if that is within `degrees`.
   */
  byHue(colors, degrees = 12) {
    const counts = colors.map(() => 0);
    this.#eachDrawn((rgb) => {
      const nearest = nearestHue(rgb, colors, degrees);
      if (nearest >= 0) counts[nearest]++;
    });
    return counts;
  }

  /**
   * Places `[x, y]` well inside areas that are of one of `colors` (see [`Picture.byHue`]), evenly over the picture:
   * `{x, y, color}`, `color` an index. Within `margin` pixels everything is of that colour.
   */
  insides(colors, margin, degrees = 12) {
    const of = new Int16Array(this.pixels).fill(-1);
    for (let i = 0; i < this.pixels; i++) of[i] = nearestHue(this.at(i), colors, degrees);
    const found = [];
    for (let y = margin; y < this.height - margin; y += margin) {
      for (let x = margin; x < this.width - margin; x += margin) {
        const color = of[y * this.width + x];
        let whole = color >= 0;
        for (let dy = -margin; whole && dy <= margin; dy++) {
          for (let dx = -margin; whole && dx <= margin; dx++) whole = of[(y + dy) * this.width + x + dx] === color;
        }
        if (whole) found.push({ x, y, color });
      }
    }
    return found;
  }

  #eachDrawn(visit) {
    for (let y = 0; y < this.height; y++) {
      const background = this.at(y * this.width);
      for (let x = 0; x < this.width; x++) {
        const rgb = this.at(y * this.width + x);
        if (farthest(rgb, background) > DRAWN) visit(rgb);
      }
    }
  }
}

function farthest(a, b) {
  return Math.max(Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1]), Math.abs(a[2] - b[2]));
}

/** Index of the colour of nearest hue, if that is within `degrees`; -1 for greys and others. */
function nearestHue(rgb, colors, degrees) {
  if (Math.max(...rgb) - Math.min(...rgb) < 26) return -1;
  const own = hue(rgb);
  const apart = colors.map(hue).map((other) => (Number.isNaN(other) ? Infinity : Math.abs(((own - other + 540) % 360) - 180)));
  const nearest = apart.indexOf(Math.min(...apart));
  return apart[nearest] <= degrees ? nearest : -1;
}

/** Hue in degrees; greys have none (NaN). */
function hue([r, g, b]) {
  const [most, least] = [Math.max(r, g, b), Math.min(r, g, b)];
  if (most === least) return NaN;
  const sixth = most === r ? (g - b) / (most - least) : most === g ? 2 + (b - r) / (most - least) : 4 + (r - g) / (most - least);
  return (sixth * 60 + 360) % 360;
}
