// Backbone and pyramid of a file of weights as an ONNX model (opset 17), for other programs to run: what `Ipdrecon::pyramid` computes, from
// pictures [1, 3, H, W] of 0 to 255 to `coarse`, `medium` and `fine`. A batch normalisation after a convolution is folded into it.

const EPSILON = 1e-5;
/** As `net::planes::MEAN` and `DEVIATION`. */
const MEAN = [127.71, 114.66, 99.32];
const DEVIATION = [75.31, 73.53, 71.66];

/** The tensors of a safetensors file, by name: `{ shape, values }`. */
export function tensors(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const length = Number(view.getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(8, 8 + length)));
  const found = new Map();
  for (const [name, entry] of Object.entries(header)) {
    if (name === '__metadata__') continue;
    const [start, end] = entry.data_offsets.map((offset) => 8 + length + offset);
    const wide = { F32: 4, F16: 2 }[entry.dtype];
    if (!wide) throw new Error(`expected ${name} as F16 or F32, found ${entry.dtype}`);
    const values = Float32Array.from({ length: (end - start) / wide }, (_, i) => (wide === 4 ? view.getFloat32(start + 4 * i, true) : half(view.getUint16(start + 2 * i, true))));
    found.set(name, { shape: entry.shape, values });
  }
  return found;
}

/** A 16-bit float's value. */
function half(bits) {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = (bits & 1023) / 1024;
  if (exponent === 31) return fraction ? Number.NaN : sign * Number.POSITIVE_INFINITY;
  return sign * (exponent === 0 ? fraction * 2 ** -14 : (1 + fraction) * 2 ** (exponent - 15));
}

/** The model's bytes for pictures of this size. */
export function model(weights, width, height) {
  const graph = new Graph();
  const get = (name) => {
    const found = weights.get(`planes.${name}`);
    if (!found) throw new Error(`expected planes.${name} in the weights, found none`);
    return found;
  };
  /** Scale and shift that a batch normalisation amounts to. */
  const factors = (name) => {
    const [gamma, beta, mean, variance] = ['gamma', 'beta', 'running_mean', 'running_var'].map((part) => get(`${name}.${part}`).values);
    const scale = gamma.map((g, i) => g / Math.sqrt(variance[i] + EPSILON));
    return { scale, shift: beta.map((b, i) => b - mean[i] * scale[i]) };
  };
  const convolution = (x, name, stride, folded, relu) => {
    const { shape, values } = get(`${name}.conv.weight`);
    const [outputs, , kernel] = shape;
    const each = values.length / outputs;
    const weight = folded ? values.map((value, i) => value * folded.scale[Math.floor(i / each)]) : values;
    const inputs = [x, graph.floats(shape, weight), ...(folded ? [graph.floats([outputs], folded.shift)] : [])];
    const group = name.endsWith('.depth') ? outputs : 1;
    const pad = Math.floor(kernel / 2);
    const y = graph.node('Conv', inputs, { kernel_shape: [kernel, kernel], strides: [stride, stride], pads: [pad, pad, pad, pad], group });
    return relu ? graph.node('Relu', [y]) : y;
  };
  const normed = (x, name, stride, relu) => convolution(x, name, stride, factors(`${name}.norm`), relu);

  const each = (values) => graph.floats([1, 3, 1, 1], Float32Array.from(values));
  let x = graph.node('Mul', ['images', each(DEVIATION.map((d) => 1 / d))]);
  x = graph.node('Add', [x, each(MEAN.map((m, i) => -m / DEVIATION[i]))]);
  x = normed(x, 'backbone.stem.first', 2, true);
  x = normed(x, 'backbone.stem.depth', 1, true);
  x = normed(x, 'backbone.stem.project', 1, false);
  const strided = [];
  for (const stage of [0, 1, 2]) {
    for (const block of [0, 1, 2]) {
      const name = `backbone.stages.${stage}.blocks.${block}`;
      let y = normed(x, `${name}.expand`, 1, true);
      y = normed(y, `${name}.depth`, block === 0 ? 2 : 1, true);
      y = normed(y, `${name}.project`, 1, false);
      x = block === 0 ? y : graph.node('Add', [y, x]);
    }
    strided.push(x);
  }
  const [quarter, eighth, sixteenth] = strided;
  // Batch normalisation, ReLU, convolution: nothing before it to fold it into.
  const out = (x, name, output) => {
    const parts = ['gamma', 'beta', 'running_mean', 'running_var'].map((part) => get(`${name}.norm.${part}`)).map(({ shape, values }) => graph.floats(shape, values));
    const y = graph.node('Relu', [graph.node('BatchNormalization', [x, ...parts], { epsilon: EPSILON })]);
    const z = convolution(y, name, 1, null, false);
    return output ? graph.rename(z, output) : z;
  };
  const enlarged = (x, lateral, stride) => {
    const doubled = graph.node('Resize', [x, '', graph.floats([4], Float32Array.of(1, 1, 2, 2))], { mode: 'linear', coordinate_transformation_mode: 'half_pixel' });
    const sides = [height, width].map((side) => Math.ceil(side / stride));
    const fits = [height, width].every((side, axis) => 2 * Math.ceil(side / (2 * stride)) === sides[axis]);
    const cut = fits ? doubled : graph.node('Slice', [doubled, graph.wholes([0, 0]), graph.wholes(sides), graph.wholes([2, 3])]);
    return graph.node('Add', [cut, lateral]);
  };
  const x8 = enlarged(sixteenth, out(eighth, 'pyramid.lateral.0'), 8);
  const x4 = enlarged(x8, out(quarter, 'pyramid.lateral.1'), 4);
  out(sixteenth, 'pyramid.out.0', 'coarse');
  out(x8, 'pyramid.out.1', 'medium');
  out(x4, 'pyramid.out.2', 'fine');
  const plane = (name, level, stride) => [name, [1, get(`pyramid.out.${level}.conv.weight`).shape[0], Math.ceil(height / stride), Math.ceil(width / stride)]];
  return graph.bytes(['images', [1, 3, height, width]], [plane('coarse', 0, 16), plane('medium', 1, 8), plane('fine', 2, 4)]);
}

/** Nodes and constants, and their bytes. Field numbers are those of onnx.proto. */
class Graph {
  nodes = [];
  constants = [];
  count = 0;

  floats(shape, values) {
    return this.constant(shape, 1, new Uint8Array(Float32Array.from(values).buffer));
  }

  wholes(values) {
    return this.constant([values.length], 7, new Uint8Array(BigInt64Array.from(values.map(BigInt)).buffer));
  }

  constant(shape, type, raw) {
    const name = `c${(this.count += 1)}`;
    this.constants.push(message([...shape.map((side) => whole(1, side)), whole(2, type), text(8, name), bytes(9, raw)]));
    return name;
  }

  /** Adds a node; gives its output's name. */
  node(kind, inputs, attributes = {}) {
    const output = `x${(this.count += 1)}`;
    this.nodes.push({ kind, inputs, attributes, output });
    return output;
  }

  rename(output, name) {
    const node = this.nodes.find((node) => node.output === output);
    node.output = name;
    return name;
  }

  bytes(input, outputs) {
    const value = (field, [name, shape]) => {
      const sides = message(shape.map((side) => bytes(1, message([whole(1, side)]))));
      return bytes(field, message([text(1, name), bytes(2, message([bytes(1, message([whole(1, 1), bytes(2, sides)]))]))]));
    };
    const nodes = this.nodes.map(({ kind, inputs, attributes, output }) => bytes(1, message([
      ...inputs.map((name) => text(1, name)), text(2, output), text(3, `${kind}_${output}`), text(4, kind),
      ...Object.entries(attributes).map((entry) => bytes(5, attribute(entry))),
    ])));
    const graph = message([...nodes, text(2, 'planes'), ...this.constants.map((constant) => bytes(5, constant)), value(11, input), ...outputs.map((output) => value(12, output))]);
    return message([whole(1, 8), text(2, 'ipdrecon'), bytes(7, graph), bytes(8, message([text(1, ''), whole(2, 17)]))]);
  }
}

function attribute([name, value]) {
  if (typeof value === 'string') return message([text(1, name), text(4, value), whole(20, 3)]);
  if (Array.isArray(value)) return message([text(1, name), ...value.map((number) => whole(8, number)), whole(20, 7)]);
  if (Number.isInteger(value)) return message([text(1, name), whole(3, value), whole(20, 2)]);
  return message([text(1, name), [...varint((2 << 3) | 5), ...new Uint8Array(Float32Array.of(value).buffer)], whole(20, 1)]);
}

// Protocol buffers: a field is its number and kind, then a whole number or a length and as many bytes.
function varint(value) {
  const found = [];
  for (; value > 127; value = Math.floor(value / 128)) found.push((value % 128) | 128);
  return [...found, value];
}
const whole = (field, value) => [...varint(field << 3), ...varint(value)];
const text = (field, value) => bytes(field, new TextEncoder().encode(value));

function bytes(field, value) {
  return message([[...varint((field << 3) | 2), ...varint(value.length)], value]);
}

function message(parts) {
  const all = new Uint8Array(parts.reduce((length, part) => length + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}
