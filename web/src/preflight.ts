/**
 * What the browser must have, asked before anything large is loaded, so that nobody waits for an engine that cannot run.
 * WebGPU is not on the list: without it the engine computes on the CPU and says so.
 */

/** Something the browser lacks, in words for its user. */
export interface Shortcoming {
  /** For programs. */
  code: "moduleWorker" | "offscreenCanvas" | "wasmSimd";
  /** One plain sentence. */
  message: string;
  /** What to try. */
  advice: string;
}

const ADVICE = "Use a current Chrome, Edge, Firefox or Safari (17 or later).";

/** Everything that is missing; empty when the engine can be loaded. */
export function preflight(): Shortcoming[] {
  const missing: Shortcoming[] = [];
  if (!hasModuleWorkers()) {
    missing.push({
      code: "moduleWorker",
      message: "This browser cannot run module workers, in which the reconstruction is computed.",
      advice: ADVICE,
    });
  }
  if (!hasOffscreenCanvas()) {
    missing.push({
      code: "offscreenCanvas",
      message: "This browser cannot draw from a worker (OffscreenCanvas), which the 3D view needs.",
      advice: ADVICE,
    });
  }
  if (!hasWasmSimd()) {
    missing.push({
      code: "wasmSimd",
      message: "This browser cannot run WebAssembly with SIMD, in which the engine is written.",
      advice: `${ADVICE} A “lockdown” or “no JIT” setting also turns WebAssembly off.`,
    });
  }
  return missing;
}

/** Whether `type: "module"` is read: the getter ends the constructor before anything would be loaded. */
function hasModuleWorkers(): boolean {
  let asked = false;
  try {
    const options = {
      get type(): WorkerType {
        asked = true;
        throw new TypeError("asked");
      },
    };
    new Worker("data:,", options).terminate();
  } catch {
    // Either the getter's own error, or no workers at all: `asked` tells which.
  }
  return asked;
}

function hasOffscreenCanvas(): boolean {
  return (
    typeof OffscreenCanvas === "function" && typeof HTMLCanvasElement.prototype.transferControlToOffscreen === "function"
  );
}

/** Validates a module of one function that uses two vector instructions. */
function hasWasmSimd(): boolean {
  if (typeof WebAssembly !== "object") return false;
  const header = [0, 97, 115, 109, 1, 0, 0, 0];
  const type = [1, 5, 1, 96, 0, 1, 123];
  const functions = [3, 2, 1, 0];
  const code = [10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11];
  return WebAssembly.validate(new Uint8Array([...header, ...type, ...functions, ...code]));
}
