// Parts of a page, and the weights as the models for other programs read them.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { root } from '../run.mjs';
import { model, tensors } from './onnx.mjs';
import { comparisons, sections, withSection } from './section.mjs';

test('a part is replaced where it stands, and comes last where there was none', () => {
  const page = withSection(withSection('# Page\n', 'one', 'first'), 'two', 'second');
  const again = withSection(page, 'one', 'changed');
  assert.match(again, /^# Page\n\n<!-- one -->\nchanged\n<!-- end of one -->\n\n<!-- two -->\nsecond\n<!-- end of two -->\n$/);
  assert.equal(sections(again), again.slice('# Page\n\n'.length).trimEnd());
});

test('what could not be compared is said, and is no row', () => {
  const row = { width: 8, height: 6, off: 1e-6, ours_ms: 2, theirs_ms: 3, ratio: 1.5, ourCold_ms: 20, theirCold_ms: 30 };
  const text = comparisons([{ device: 'one', comparisons: [row, { width: 9, height: 9, failed: 'they differ' }] }]);
  assert.match(text, /\| one \| 8x6 \| 2.00 \| 3.00 \| 1.50 \|/);
  assert.match(text, /Not compared on one at 9x9: they differ/);
  assert.equal(text.match(/9x9/g)?.length, 1);
});

/** The fields of a message of protocol buffers: number, then whole number or bytes. */
function* fields(bytes) {
  let at = 0;
  const number = () => {
    let value = 0;
    for (let by = 1; ; by *= 128) {
      const byte = bytes[at++];
      value += (byte & 127) * by;
      if (byte < 128) return value;
    }
  };
  while (at < bytes.length) {
    const key = number();
    const [field, kind] = [key >> 3, key & 7];
    if (kind === 0) yield [field, number()];
    else {
      const length = kind === 2 ? number() : 4;
      yield [field, bytes.subarray(at, (at += length))];
    }
  }
}

test('the released backbone becomes a model of named inputs and outputs, with every convolution', () => {
  const weights = tensors(readFileSync(join(root, 'weights/ipdrecon.safetensors')));
  const { shape, values } = weights.get('planes.backbone.stem.first.conv.weight');
  assert.deepEqual(shape, [16, 3, 3, 3]);
  assert.ok(values.every((value) => Number.isFinite(value) && Math.abs(value) < 10) && new Set(values).size > 400, 'numbers of weights, not noise');
  const [[, graph]] = [...fields(model(weights, 200, 120))].filter(([field]) => field === 7);
  const text = (bytes) => new TextDecoder().decode(bytes);
  const kinds = {};
  const names = { 11: [], 12: [] };
  for (const [field, bytes] of fields(graph)) {
    if (field === 1) {
      const [[, name]] = [...fields(bytes)].filter(([field]) => field === 4);
      const kind = text(name);
      kinds[kind] = (kinds[kind] ?? 0) + 1;
    } else if (field in names) names[field].push(text([...fields(bytes)][0][1]));
  }
  // Three of the stem, three of each of nine blocks, five of the pyramid; of 200x120 the plane at 8 is a column narrower than twice that at 16.
  assert.deepEqual(kinds, { Mul: 1, Add: 1 + 6 + 2, Conv: 3 + 27 + 5, Relu: 2 + 18 + 5, BatchNormalization: 5, Resize: 2, Slice: 1 });
  assert.deepEqual(names, { 11: ['images'], 12: ['coarse', 'medium', 'fine'] });
});
