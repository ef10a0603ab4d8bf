// Times examples/mesh_wasm.rs, built for wasm32: node mesh_wasm.mjs MODULE.wasm. Prints one JSON object.

import { readFile } from 'node:fs/promises';
import { performance } from 'node:perf_hooks';

const ROUNDS = 5;

const module = await WebAssembly.compile(await readFile(process.argv[2]));
const { exports } = await WebAssembly.instantiate(module, {});

/** Milliseconds of the next step. */
function step() {
  const begun = performance.now();
  exports.main(0, 0);
  return performance.now() - begun;
}

// The first step makes the cloud, the second lets the engine compile.
step();
const cold = process.cpuUsage();
const first = step();
const cpu = process.cpuUsage();
const times = Array.from({ length: ROUNDS }, step);
const used = process.cpuUsage(cpu);
console.log(
  JSON.stringify({
    engine: `node ${process.version}`,
    points_at_least: 500_000,
    first_ms: first,
    first_cpu_ms: (cpu.user - cold.user + cpu.system - cold.system) / 1e3,
    mesh_ms: times.toSorted((a, b) => a - b)[Math.floor(ROUNDS / 2)],
    mesh_cpu_ms: (used.user + used.system) / 1e3 / ROUNDS,
    memory_mib: exports.memory.buffer.byteLength / 2 ** 20,
  }),
);
