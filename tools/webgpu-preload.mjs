// Gives Node a WebGPU through Dawn, for kernels under wasm-bindgen-test: `NODE_OPTIONS="--import …/webgpu-preload.mjs"`.
import { create, globals } from 'webgpu';

Object.assign(globalThis, globals);
Object.defineProperty(globalThis, 'navigator', { value: { gpu: create([]) }, configurable: true });
// wgpu asks whether the global is a window or a worker before it looks for navigator.gpu.
class Window {
  static [Symbol.hasInstance](value) {
    return value === globalThis;
  }
}
Object.assign(globalThis, { Window, window: globalThis });
