// Chance that can be had again: the seed says all that it will bring.

/** Numbers that look random (mulberry32), the same for the same seed. */
export class Chance {
  #state;

  constructor(seed) {
    this.#state = seed >>> 0;
  }

  /** A number from 0 to 1, 1 left out. */
  next() {
    this.#state = (this.#state + 0x6d2b79f5) >>> 0;
    let t = this.#state;
    t = Math.imul(t ^ (t >>> 15), t | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  }

  /** A whole number from 0 to `most`, `most` left out. */
  below(most) {
    return Math.floor(this.next() * most);
  }

  /** One of a list. */
  of(list) {
    return list[this.below(list.length)];
  }
}
