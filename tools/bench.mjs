// `npm run bench`: prepares the machine and runs the benchmarks of every crate on the same device as the tests; words after it choose some.
import { gpu, buildEnv } from './env.mjs';
import { run } from './run.mjs';
import { setup } from './setup.mjs';

if (!(await setup('test'))) process.exit(1);
const { code } = await run('cargo', ['bench', '--workspace', '--benches', ...process.argv.slice(2)], { env: gpu(buildEnv()), show: true });
process.exit(code);
