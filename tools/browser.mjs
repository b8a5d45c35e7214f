// Headless Chromium with WebGPU on SwiftShader, for tests and benchmarks: compute and canvas both, in a page and in a worker.
import { chromium } from 'playwright-core';
import { proven } from './setup/state.mjs';

/** With fewer of the four GPU flags compute starts and the first canvas fails, or the canvas stays white without an error. */
const flags = [
  '--enable-unsafe-webgpu',
  '--enable-features=Vulkan',
  '--use-vulkan=swiftshader',
  '--use-angle=swiftshader',
  '--no-sandbox',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
];

/** Starts a browser; `webgpu: false` gives one without WebGPU, as an old machine has. */
export function launch({ webgpu = true } = {}) {
  const args = webgpu ? flags : [...flags.slice(4), '--disable-features=WebGPU', '--disable-gpu'];
  return chromium.launch({ executablePath: proven('chromium'), headless: false, args: ['--headless=new', ...args] });
}
