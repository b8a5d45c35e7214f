// A GPU for the tests under Node: Dawn must give an adapter. On Linux that is Mesa's lavapipe from release 25 on; older ones Dawn refuses.
import { readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { Missing, root, run } from '../run.mjs';
import { gpu, lavapipe } from '../env.mjs';
import { addBackports, candidate, install } from './apt.mjs';
import { prove, proven } from './state.mjs';

const oldest = 25;
const probe = `
  import { create, globals } from 'webgpu';
  Object.assign(globalThis, globals);
  const adapter = await create([]).requestAdapter();
  console.log(adapter ? adapter.info.description || adapter.info.vendor || 'unnamed' : '');
  process.exit(adapter ? 0 : 1);`;

/** What the adapter depends on: Dawn's version and the Mesa that is installed. */
function key() {
  const dawn = JSON.parse(readFileSync(join(root, 'node_modules/webgpu/package.json'), 'utf8')).version;
  const icd = process.platform === 'linux' ? lavapipe() : null;
  if (!icd) return `dawn ${dawn}`;
  return `dawn ${dawn}, ${icd} of ${statSync(icd).mtimeMs}`;
}

async function accepted() {
  if (process.platform === 'linux' && !lavapipe()) return false;
  const result = await run(process.execPath, ['--input-type=module', '-e', probe], { env: gpu(process.env), limitSeconds: 60 });
  if (result.code === 0) prove('gpu', key());
  return result.code === 0;
}

const major = (version) => Number(/^(?:\d+:)?(\d+)/.exec(version ?? '')?.[1] ?? 0);

export async function mesa(say) {
  if (proven('gpu') === key()) return;
  if (await accepted()) return;
  if (process.platform !== 'linux') throw new Missing('WebGPU under Node found no adapter here; the kernel tests need a machine with a GPU or Linux with Mesa 25');
  const offered = await candidate('mesa-vulkan-drivers');
  let suite;
  if (offered && major(offered) < oldest) {
    suite = await addBackports();
    if (!suite) throw new Missing(`install Mesa ${oldest} or newer (this release has ${offered}; Dawn refuses its software Vulkan)`);
  }
  say(`apt-get install ${suite ? `-t ${suite} ` : ''}mesa-vulkan-drivers`);
  await install(['mesa-vulkan-drivers', 'libvulkan1'], suite);
  if (!(await accepted())) throw new Missing(`Dawn refuses this Mesa's software Vulkan; install mesa-vulkan-drivers ${oldest} or newer`);
}
