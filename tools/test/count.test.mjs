import assert from 'node:assert/strict';
import { test } from 'node:test';
import { afterSecondTry, count, failedFiles, failedTargets, failures, reasons, sum } from './count.mjs';

const of = (passed, failed, skipped) => ({ passed, failed, skipped });

test('cargo: several binaries add up, a test that says it was skipped is no pass', () => {
  const output = `running 2 tests
test a ... ok
successes:

---- real_scan stdout ----
skipped: the scan is not here

---- other stdout ----
a line that only mentions skipped: things

test result: ok. 2 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s
test result: FAILED. 3 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s
`;
  assert.deepEqual(count('cargo', { output, code: 101 }), of(4, 1, 2));
  assert.deepEqual(reasons(output), ['skipped: the scan is not here']);
});

test('cargo: a program that ends with an error without a failed test has failed', () => {
  assert.deepEqual(count('cargo', { output: 'error: could not compile', code: 101 }), of(0, 1, 0));
});

test('no test at all is a failure', () => {
  assert.deepEqual(count('cargo', { output: 'test result: ok. 0 passed; 0 failed; 0 ignored', code: 0 }), of(0, 1, 0));
});

test('node: both reporters, coloured or not', () => {
  assert.deepEqual(count('node', { output: '# pass 3\n# fail 0\n# cancelled 0\n# skipped 1\n# todo 0\n', code: 0 }), of(3, 0, 1));
  assert.deepEqual(count('node', { output: '\x1b[34mℹ pass 3\x1b[39m\nℹ fail 2\nℹ cancelled 1\nℹ skipped 0\n', code: 1 }), of(3, 3, 0));
});

test('python: failures, errors and skips are taken from the runs', () => {
  assert.deepEqual(count('python', { output: 'Ran 9 tests in 0.1s\n\nFAILED (failures=1, errors=2, skipped=3)\n', code: 1 }), of(3, 3, 3));
  assert.deepEqual(count('python', { output: 'Ran 4 tests in 0.1s\n\nOK (skipped=1)\n', code: 0 }), of(3, 0, 1));
  assert.deepEqual(count('python', { output: 'Ran 4 tests in 0.1s\n\nOK\n', code: 0 }), of(4, 0, 0));
});

test('sums', () => {
  assert.deepEqual(sum([of(1, 0, 0), of(2, 3, 4)]), of(3, 3, 4));
});

test('what failed is found among what passed, in the words of each test program', () => {
  const cargo = 'successes:\n\n---- a stdout ----\nfine\n\n\nsuccesses:\n    a\n\nfailures:\n\n---- b stdout ----\npanicked: 3 m, not 4 m\n\n\nfailures:\n    b\n\ntest result: FAILED.\n';
  assert.equal(failures(cargo + cargo), Array(2).fill('---- b stdout ----\npanicked: 3 m, not 4 m').join('\n\n'));
  assert.equal(failures('✔ a (2ms)\nℹ fail 1\n\n✖ failing tests:\n\ntest at b.mjs:3\n✖ b\n  54 ms\n'), 'test at b.mjs:3\n✖ b\n  54 ms');
  const line = '-'.repeat(70);
  assert.equal(failures(`..F\n${'='.repeat(70)}\nFAIL: test_b\n${line}\n1 != 2\n\n${line}\nRan 3 tests`), `FAIL: test_b\n${line}\n1 != 2`);
});

test('where nothing says what failed, the end is shown', () => {
  const output = Array.from({ length: 300 }, (_, i) => `line ${i}`).join('\n');
  assert.ok(failures(`${output}\nerror: could not compile`).endsWith('line 299\nerror: could not compile'));
  assert.ok(!failures(output).includes('line 199\n'));
});

test('a second run is of what failed, by file and by target', () => {
  const node = 'test at tests/a.test.mjs:3:1\n✖ b\ntest at tests/a.test.mjs:9:1\n✖ c\ntest at tests/d.test.mjs:9:1\n✖ d\n';
  assert.deepEqual(failedFiles(node), ['tests/a.test.mjs', 'tests/d.test.mjs']);
  const cargo = 'error: 2 targets failed:\n    `-p recon --lib`\n    `-p cli --test bench_command`\n';
  assert.deepEqual(failedTargets(cargo), ['--lib', '--test', 'bench_command']);
  assert.deepEqual(failedTargets('error: could not compile `recon`'), []);
});

test('what passes on its second try has passed; a second run that broke mends nothing', () => {
  assert.deepEqual(afterSecondTry(of(70, 2, 1), of(9, 0, 0)), of(72, 0, 1));
  assert.deepEqual(afterSecondTry(of(70, 2, 1), of(8, 1, 0)), of(71, 1, 1));
  assert.deepEqual(afterSecondTry(of(70, 2, 1), of(0, 1, 0)), of(70, 2, 1));
});
