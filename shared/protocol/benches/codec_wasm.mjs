// Times examples/codec_wasm.rs, built for wasm32: node codec_wasm.mjs MODULE.wasm. Prints one JSON object.

import { readFile } from 'node:fs/promises';
import { performance } from 'node:perf_hooks';

const POINTS = 200 * 1024;
const ROUNDS = 9;

const module = await WebAssembly.compile(await readFile(process.argv[2]));
const { exports } = await WebAssembly.instantiate(module, {});

/** Milliseconds of the next step: steps alternate between encoding and decoding. */
function step() {
  const begun = performance.now();
  exports.main(0, 0);
  return performance.now() - begun;
}

/** The middle of several times. */
function median(times) {
  return times.toSorted((a, b) => a - b)[Math.floor(times.length / 2)];
}

// The first pair builds the chunks and lets the engine compile.
step();
step();
const encode = [];
const decode = [];
for (let i = 0; i < ROUNDS; i += 1) {
  encode.push(step());
  decode.push(step());
}
const rate = (times) => POINTS / median(times) / 1e3;
console.log(
  JSON.stringify({
    engine: `node ${process.version}`,
    points: POINTS,
    encode_mpoints_per_s: rate(encode),
    decode_mpoints_per_s: rate(decode),
  }),
);
