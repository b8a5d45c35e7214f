// How far the vertices of two meshes lie apart. Samples would measure the sampling; vertices of equal meshes are equal.

/** Vertex positions of a binary little-endian PLY whose vertices start with three floats. */
export function vertices(ply) {
  const end = ply.indexOf('end_header\n') + 'end_header\n'.length;
  const header = ply.toString('latin1', 0, end);
  const count = Number(/element vertex (\d+)/.exec(header)[1]);
  const sizes = { char: 1, uchar: 1, short: 2, ushort: 2, int: 4, uint: 4, float: 4, double: 8 };
  const properties = header.slice(header.indexOf('element vertex'), header.indexOf('element face')).matchAll(/^property (\w+) (\w+)$/gm);
  const layout = [...properties];
  if (layout.slice(0, 3).map(([, type, name]) => `${type} ${name}`).join() !== 'float x,float y,float z') throw new Error(`another layout: ${header}`);
  const stride = layout.reduce((sum, [, type]) => sum + sizes[type], 0);
  return Array.from({ length: count }, (_, i) => [0, 4, 8].map((offset) => ply.readFloatLE(end + i * stride + offset)));
}

/** Mean distance from each point of `from` to the nearest of `to`, in metres; `cell` bounds the search. */
function mean(from, to, cell = 0.05) {
  const key = (x, y, z) => `${x},${y},${z}`;
  const cells = new Map();
  for (const point of to) {
    const at = key(...point.map((value) => Math.floor(value / cell)));
    if (cells.has(at)) cells.get(at).push(point);
    else cells.set(at, [point]);
  }
  let sum = 0;
  for (const point of from) {
    const [x, y, z] = point.map((value) => Math.floor(value / cell));
    // Farther than a cell counts as a cell: the mean is then too small by nothing that matters at a millimetre.
    let nearest = cell;
    for (let i = 0; i < 27; i++) {
      for (const other of cells.get(key(x + (i % 3) - 1, y + (Math.floor(i / 3) % 3) - 1, z + Math.floor(i / 9) - 1)) ?? []) {
        nearest = Math.min(nearest, Math.hypot(point[0] - other[0], point[1] - other[1], point[2] - other[2]));
      }
    }
    sum += nearest;
  }
  return sum / from.length;
}

/** The chamfer distance in metres: the mean of both ways. */
export const chamfer = (a, b) => (mean(a, b) + mean(b, a)) / 2;
