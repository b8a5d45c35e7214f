// Debian's way to the wasm32 target: its rustc-web builds its own standard library for wasm, and rustup links it as the toolchain `debian`.
import { cpSync, mkdirSync, mkdtempSync, readdirSync, readlinkSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { must, write } from '../run.mjs';
import { install } from './apt.mjs';

/** The library's crates; `test` and `proc_macro` are needed by `cargo test` for wasm. */
const crates = 'std,panic_abort,panic_unwind,test,proc_macro';

export async function installDebianTarget(target) {
  await install(['rustc-web', 'cargo-web', 'rust-web-src', 'rust-web-llvm']);
  // rust-lld is a link to the linker of the LLVM that this rustc was built with, which is a package of the same name (`lld-22`).
  await install([basename(readlinkSync('/usr/bin/rust-lld'))]);

  const folder = mkdtempSync(join(tmpdir(), 'wasm-std-'));
  try {
    write(join(folder, 'Cargo.toml'), '[package]\nname = "empty"\nedition = "2021"\n');
    write(join(folder, 'src/lib.rs'), '');
    const { RUSTFLAGS, RUSTUP_TOOLCHAIN, ...rest } = process.env;
    const env = { ...rest, PATH: `/usr/bin:${rest.PATH}`, RUSTC: '/usr/bin/rustc', RUSTC_BOOTSTRAP: '1', CARGO_TARGET_DIR: join(folder, 'target') };
    await must('/usr/bin/cargo', ['build', '--release', '--target', target, `-Zbuild-std=${crates}`], { cwd: folder, env, limitSeconds: 900 });
    const built = join(folder, 'target', target, 'release/deps');
    const library = `/usr/lib/rustlib/${target}/lib`;
    mkdirSync(library, { recursive: true });
    for (const name of readdirSync(built)) {
      if (name.endsWith('.rlib') && !name.startsWith('libempty')) cpSync(join(built, name), join(library, name));
    }
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
  await must('rustup', ['toolchain', 'link', 'debian', '/usr']);
}
