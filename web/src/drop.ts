/**
 * From what a visitor dropped or picked to a flat list of files. The three ways a browser hands over a folder (entries of a
 * drop, a directory handle, an `<input webkitdirectory>`) are walked as one kind of tree here. Files stay on disk: only their
 * handles are gathered, and the walk lets the page breathe.
 */

/** What was dropped, ready for the engine. */
export type Dropped =
  | { kind: "zip"; name: string; file: File }
  | {
      kind: "folder";
      name: string;
      /** Relative to what was dropped, with forward slashes; one for each file. */
      paths: string[];
      files: File[];
      /** What the browser would not let us read. */
      unreadable: Unreadable[];
    };

/** A file or folder that the browser would not let us read. */
export interface Unreadable {
  path: string;
  reason: string;
}

/** Whatever a page may have in its hands after a drop or a pick. */
export type Droppable =
  | DataTransfer
  | Iterable<File>
  | Iterable<FileSystemEntry>
  | FileSystemDirectoryHandle
  | FileSystemFileHandle;

/** Nothing usable was dropped. */
export class DropError extends Error {
  override readonly name = "DropError";
  constructor(
    message: string,
    /** What to try. */
    readonly advice: string,
    /** What could not be read, if that is why. */
    readonly unreadable: Unreadable[] = [],
  ) {
    super(message);
  }
}

/** A file or folder, wherever it comes from. */
type Node =
  | { kind: "file"; path: string; read: () => Promise<File> }
  | { kind: "folder"; path: string; list: () => AsyncIterable<Node> };

/** Files whose handles are asked for at once. */
const AT_ONCE = 32;
/** Longest stretch of work before the page gets its turn, milliseconds. */
const SLICE_MS = 12;

/**
 * Gathers every file under what was dropped or picked.
 *
 * A `DataTransfer` is emptied by the browser as soon as its event is over, so call this in the handler itself, before any
 * `await`.
 *
 * @throws DropError when there is nothing in it that can be read.
 */
export function collect(from: Droppable): Promise<Dropped> {
  // Not an async function on purpose: the roots must be taken while the event is alive.
  const roots = rootsOf(from);
  return gather(roots);
}

/** The file of weights that alone was dropped or picked, if that is so. Call it in the handler itself, as {@link collect}. */
export function weightsOf(from: Droppable): (() => Promise<File>) | undefined {
  if (!(from instanceof DataTransfer) && !Array.isArray(from)) return undefined;
  const [only, ...others] = rootsOf(from);
  return only?.kind === "file" && others.length === 0 && /\.safetensors$/i.test(only.path) ? only.read : undefined;
}

async function gather(roots: Node[]): Promise<Dropped> {
  const only = roots.length === 1 ? roots[0] : undefined;
  if (only?.kind === "file" && isZip(only.path)) {
    return { kind: "zip", name: only.path, file: await only.read().catch((cause) => Promise.reject(unread(only.path, cause))) };
  }

  const found = new Map<string, File>();
  const unreadable: Unreadable[] = [];
  const breathe = breather();
  let batch: Promise<void>[] = [];
  const take = async ({ path, read }: Extract<Node, { kind: "file" }>): Promise<void> => {
    try {
      found.set(path, await read());
    } catch (cause) {
      unreadable.push({ path, reason: reasonOf(cause) });
    }
  };
  const walk = async (node: Node): Promise<void> => {
    if (isHidden(node.path)) return;
    if (node.kind === "file") {
      batch.push(take(node));
      if (batch.length >= AT_ONCE) {
        await Promise.all(batch);
        batch = [];
      }
      await breathe();
      return;
    }
    try {
      for await (const child of node.list()) await walk(child);
    } catch (cause) {
      unreadable.push({ path: node.path, reason: reasonOf(cause) });
    }
  };
  for (const root of roots) await walk(root);
  await Promise.all(batch);

  const name = nameOf(roots);
  if (found.size === 0) throw nothingIn(name, unreadable);
  // Directory listings come in no order that means anything: sorted, the same folder is always the same message.
  const paths = [...found.keys()].sort();
  return { kind: "folder", name, paths, files: paths.map((path) => found.get(path) as File), unreadable };
}

function rootsOf(from: Droppable): Node[] {
  if (from instanceof DataTransfer) {
    const entries = [...from.items].flatMap((item) => item.webkitGetAsEntry() ?? []);
    return entries.length > 0 ? entries.map(fromEntry) : [...from.files].map(fromFile);
  }
  if ("kind" in from) return [fromHandle(from, from.name)];
  return [...(from as Iterable<File | FileSystemEntry>)].map((item) =>
    item instanceof File ? fromFile(item) : fromEntry(item),
  );
}

function fromFile(file: File): Node {
  return { kind: "file", path: file.webkitRelativePath || file.name, read: () => Promise.resolve(file) };
}

function fromEntry(entry: FileSystemEntry): Node {
  const path = entry.fullPath.replace(/^\/+/, "") || entry.name;
  if (entry.isFile) {
    const read = (): Promise<File> => new Promise((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    return { kind: "file", path, read };
  }
  return { kind: "folder", path, list: () => entriesOf(entry as FileSystemDirectoryEntry) };
}

/** `readEntries` gives a part at a time (Chromium: 100) and an empty part at the end. */
async function* entriesOf(folder: FileSystemDirectoryEntry): AsyncGenerator<Node> {
  const reader = folder.createReader();
  for (;;) {
    const part = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (part.length === 0) return;
    yield* part.map(fromEntry);
  }
}

function fromHandle(handle: FileSystemHandle, path: string): Node {
  if (handle.kind === "file") return { kind: "file", path, read: () => (handle as FileSystemFileHandle).getFile() };
  const list = async function* (): AsyncGenerator<Node> {
    for await (const [name, child] of (handle as FileSystemDirectoryHandle).entries()) yield fromHandle(child, `${path}/${name}`);
  };
  return { kind: "folder", path, list };
}

/** Lets the page have its turn whenever the walk has kept it for a while. */
function breather(): () => Promise<void> {
  let since = performance.now();
  return async () => {
    if (performance.now() - since < SLICE_MS) return;
    await new Promise((resolve) => setTimeout(resolve));
    since = performance.now();
  };
}

/** What operating systems and archivers leave among the visitor's files. What was dropped itself was meant. */
function isHidden(path: string): boolean {
  const [, ...below] = path.split("/");
  return below.some((name) => name.startsWith(".") || name === "__MACOSX" || name === "Thumbs.db" || name === "desktop.ini");
}

function isZip(path: string): boolean {
  return /\.zip$/i.test(path);
}

function nameOf(roots: Node[]): string {
  const tops = new Set(roots.map(({ path }) => path.split("/", 1)[0] ?? path));
  const [first] = tops;
  return first !== undefined && tops.size === 1 ? first : "the dropped files";
}

function nothingIn(name: string, unreadable: Unreadable[]): DropError {
  const [first] = unreadable;
  if (first) return unread(first.path, first.reason, unreadable);
  return name === "the dropped files"
    ? new DropError("Nothing that can be opened was dropped.", "Drop the folder of the scan, or a .zip of it.")
    : new DropError(`“${name}” is empty.`, "Drop the folder that holds the photos and their poses, or a .zip of it.");
}

function unread(path: string, cause: unknown, unreadable: Unreadable[] = []): DropError {
  const reason = reasonOf(cause);
  const all = unreadable.length > 0 ? unreadable : [{ path, reason }];
  return new DropError(`The browser could not read “${path}” (${reason}).`, "Check that it still exists and may be read, then drop it again.", all);
}

function reasonOf(cause: unknown): string {
  return cause instanceof Error ? cause.message.replace(/\.$/, "") || cause.name : String(cause);
}
