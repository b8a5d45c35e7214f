// What is measured in a page and under Node alike: the network's parts by our wasm, and backbone and pyramid beside ONNX Runtime Web.
// Nothing here may name Node or the page.

/** Milliseconds after which both are warm, and after which a comparison takes no more rounds. */
const WARM_MS = 3_000;
const ENOUGH_MS = 30_000;
const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];

/** The picture of `bench::input::image`. */
const picture = (width, height) => Float32Array.from({ length: 3 * width * height }, (_, i) => (i * 7919) % 251);

/** A session of ONNX Runtime Web, ready to run again and again: `run` waits for the result, `numbers` gives coarse, medium, fine. */
async function peer(ort, gpu, bytes, width, height) {
  ort.env.wasm.numThreads = 1;
  const start = performance.now();
  const session = await ort.InferenceSession.create(bytes, gpu
    ? { executionProviders: ['webgpu'], preferredOutputLocation: 'gpu-buffer', graphOptimizationLevel: 'all' }
    : { executionProviders: ['wasm'], graphOptimizationLevel: 'all' });
  const values = picture(width, height);
  const dims = [1, 3, height, width];
  let images = new ort.Tensor('float32', values, dims);
  let wait = async () => {};
  if (gpu) {
    const device = await ort.env.webgpu.device;
    // Usage: storage, copied to, copied from.
    const buffer = device.createBuffer({ size: values.byteLength, usage: 0x80 | 0x8 | 0x4 });
    device.queue.writeBuffer(buffer, 0, values);
    images = ort.Tensor.fromGpuBuffer(buffer, { dataType: 'float32', dims });
    wait = () => device.queue.onSubmittedWorkDone();
  }
  const numbers = async () => {
    const found = await session.run({ images });
    const levels = [];
    for (const name of ['coarse', 'medium', 'fine']) levels.push(Array.from(await found[name].getData()));
    for (const tensor of Object.values(found)) tensor.dispose();
    return levels.flat();
  };
  const run = async () => {
    const found = await session.run({ images });
    await wait();
    if (gpu) for (const tensor of Object.values(found)) tensor.dispose();
  };
  await run();
  return { run, numbers, cold_ms: performance.now() - start, end: () => session.release() };
}

/** The largest difference as a share of the largest number. */
function apart(a, b) {
  if (a.length !== b.length) return Number.POSITIVE_INFINITY;
  let [most, largest] = [0, 0];
  for (let i = 0; i < a.length; i += 1) {
    // So that a number that is none is never taken for near.
    const off = Math.abs(a[i] - b[i]);
    most = off <= most ? most : off;
    largest = Math.max(largest, Math.abs(b[i]));
  }
  return most / largest;
}

/** Runs a few times, or less often where that takes longer. */
async function repeated(run, times, limit_ms) {
  const start = performance.now();
  for (let i = 0; i < times && performance.now() - start < limit_ms; i += 1) await run();
}

/**
 * Backbone and pyramid, ours and ONNX Runtime Web's in turns. `ratio` is their time over ours, the median over rounds.
 * Throws where the two do not compute the same: then there is nothing to compare.
 */
export async function compare({ bench, ort, gpu, onnx, width, height, rounds = 7, runs = 5 }) {
  const theirs = await peer(ort, gpu, onnx, width, height);
  const [ourCold_ms] = await bench.pyramid(width, height, 1);
  const off = apart(await bench.pyramid_numbers(width, height), await theirs.numbers());
  if (!(off < 1e-3)) throw new Error(`expected the same numbers of both within 1e-3, found ${off} apart at ${width}x${height}: nothing to compare`);
  // Until the browser's compiler is done with both.
  if (rounds > 1) {
    await repeated(() => bench.pyramid(width, height, 1), 20, WARM_MS);
    await repeated(theirs.run, 40, WARM_MS);
  }
  const times = [];
  const enough_ms = performance.now() + ENOUGH_MS;
  for (let round = 0; round < rounds && (round === 0 || performance.now() < enough_ms); round += 1) {
    const [, ours] = await bench.pyramid(width, height, runs);
    const own = [];
    for (let i = 0; i < runs + 1; i += 1) {
      const start = performance.now();
      await theirs.run();
      if (i > 0) own.push(performance.now() - start);
    }
    times.push([ours, median(own)]);
  }
  await theirs.end();
  return {
    width, height, off, rounds: times.length,
    ours_ms: median(times.map(([ours]) => ours)), theirs_ms: median(times.map(([, theirs]) => theirs)),
    ratio: median(times.map(([ours, theirs]) => theirs / ours)),
    ourCold_ms, theirCold_ms: theirs.cold_ms,
  };
}

/** All of one device: `{ comparisons, report }`. */
export async function measure({ Bench, ort, gpu, weights, models, views, edge, runs, rounds, sizes }) {
  const bench = await Bench.open(weights, gpu);
  const comparisons = [];
  for (const { width, height, bytes } of models) {
    try {
      comparisons.push(await compare({ bench, ort, gpu, onnx: bytes, width, height, rounds }));
    } catch (error) {
      comparisons.push({ width, height, failed: String(error?.message ?? error) });
    }
  }
  const report = JSON.parse(await bench.report(Uint32Array.from(sizes.flat()), Uint32Array.from(views), edge, runs));
  return { comparisons, report };
}
