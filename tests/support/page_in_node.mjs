// Runs the WebAssembly of a page: FILE OUTPUTS STEPS INTO; writes rows of the time and the outputs, as doubles.
import { readFileSync, writeFileSync } from "node:fs";
const [file, outputs, steps, into] = process.argv.slice(2);
const engine = (await WebAssembly.instantiate(readFileSync(file), {})).instance.exports;
engine._initialize?.();
const one = engine.create(), width = Number(outputs) + 1, n = Number(steps), rows = engine.rows(n + 1);
if (engine.start(one, rows)) throw new Error("not started");
if (engine.advance(one, n, 1, rows + 8 * width) < n) throw new Error("a part failed");
writeFileSync(into, new Uint8Array(engine.memory.buffer, rows, 8 * width * (n + 1)));
