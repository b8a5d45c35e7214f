// The command line, for comparison with the page: the same crate fuses and judges.
import { execFile } from 'node:child_process';
import { promisify } from 'node:util';
import { join } from 'node:path';
import { buildEnv } from '../../tools/env.mjs';
import { must, root } from '../../tools/run.mjs';

const program = join(root, 'target/release/ipdrecon');
const execute = promisify(execFile);

/** Builds the command line, in the words of the native tests: cargo then settles on the same features and has it built already. */
export const build = () => must('cargo', ['test', '--release', '--workspace', '--locked', '--no-run'], { env: buildEnv() });

/** Fuses a scan into a mesh. */
export const fuse = (scan, out) => execute(program, ['fuse', scan, '-o', out]);

/** Depth from the photos of a scan, into a mesh; on the processor, as the next. */
export const stereo = (scan, out, { views, size }) => execute(program, ['stereo', scan, '-o', out, '--views', String(views), '--size', size]);

/** The network's surface from the photos of a scan, into a mesh. */
export const reconstruct = (scan, out, { keyframes }) => execute(program, ['reconstruct', scan, '-o', out, '--preset', 'small', '--keyframes', String(keyframes)]);

/** Writes the sample room as a folder of files. */
export const sampleFolder = (folder) => execute(join(root, 'target/release/examples/sample_folder'), [folder]);

/** The figures of a mesh, as the object that `--json` prints. */
export async function judge(pred, gt, protocol, scan) {
  const words = ['eval', '--pred', pred, '--gt', gt, '--protocol', protocol, '--json', ...(scan ? ['--scan', scan] : [])];
  const { stdout } = await execute(program, words, { maxBuffer: 1 << 24 });
  return JSON.parse(stdout);
}
