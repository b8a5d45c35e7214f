// A small scan made by rule, and the files to spoil it with: an empty box of 4 x 4 x 2.6 m seen from its middle by 12 cameras
// that turn around, in the layout of 7-Scenes.
import { mkdirSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { deflateSync } from 'node:zlib';

const [width, height, focal_px] = [96, 72, 80];
const half_m = [2, 1.3, 2];

/** CRC-32 as PNG and zip use it. */
function crc32(bytes) {
  let crc = -1;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit += 1) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return (crc ^ -1) >>> 0;
}

/** A PNG of rows that are already bytes: 16-bit grey or 8-bit RGB. */
function png(width, height, { bits, colour }, row) {
  const chunk = (type, data) => {
    const body = Buffer.concat([Buffer.from(type, 'latin1'), data]);
    const out = Buffer.alloc(body.length + 8);
    out.writeUInt32BE(data.length, 0);
    body.copy(out, 4);
    out.writeUInt32BE(crc32(body), body.length + 4);
    return out;
  };
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header.set([bits, colour, 0, 0, 0], 8);
  const rows = Array.from({ length: height }, (_, y) => Buffer.concat([Buffer.from([0]), row(y)]));
  const signature = Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]);
  return Buffer.concat([signature, chunk('IHDR', header), chunk('IDAT', deflateSync(Buffer.concat(rows))), chunk('IEND', Buffer.alloc(0))]);
}

/** Depth along the camera's axis (metres) and the wall that is hit, for a camera turned by `yaw` about the vertical. */
function look(yaw, x, y) {
  const [dx, dy] = [(x - width / 2) / focal_px, (y - height / 2) / focal_px];
  const ray = [Math.cos(yaw) * dx + Math.sin(yaw), dy, -Math.sin(yaw) * dx + Math.cos(yaw)];
  const walls = ray.map((part, axis) => half_m[axis] / Math.abs(part));
  const depth_m = Math.min(...walls);
  const axis = walls.indexOf(depth_m);
  return { depth_m, wall: axis * 2 + (ray[axis] > 0 ? 1 : 0) };
}

const paint = [[196, 186, 170], [170, 186, 196], [120, 96, 72], [235, 235, 230], [150, 180, 150], [200, 150, 140]];

/** A 16-bit depth image in millimetres. */
export function depthPng(yaw, size = { width, height }) {
  return png(size.width, size.height, { bits: 16, colour: 0 }, (y) => {
    const row = Buffer.alloc(size.width * 2);
    for (let x = 0; x < size.width; x += 1) row.writeUInt16BE(Math.round(look(yaw, x, y).depth_m * 1000), x * 2);
    return row;
  });
}

function colourPng(yaw) {
  return png(width, height, { bits: 8, colour: 2 }, (y) => Buffer.from(Array.from({ length: width }, (_, x) => paint[look(yaw, x, y).wall]).flat()));
}

/** Camera to world, y down; the 2 cm of sway keep two frames from being the same. */
export function pose(yaw, frame) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const rows = [[c, 0, s, 0], [0, 1, 0, 0.02 * (frame % 2)], [-s, 0, c, 0], [0, 0, 0, 1]];
  return rows.map((row) => row.map((n) => n.toFixed(9)).join(' ')).join('\n') + '\n';
}

/** All files of a sound scan by their paths. */
export function scan(frames = 12) {
  const files = { 'camera-intrinsics.txt': `${focal_px} 0 ${width / 2}\n0 ${focal_px} ${height / 2}\n0 0 1\n` };
  for (let frame = 0; frame < frames; frame += 1) {
    const yaw = (frame / frames) * 2 * Math.PI;
    const name = `frame-${String(frame).padStart(6, '0')}`;
    files[`${name}.color.png`] = colourPng(yaw);
    files[`${name}.depth.png`] = depthPng(yaw);
    files[`${name}.pose.txt`] = pose(yaw, frame);
  }
  return files;
}

/** Writes files below `folder` and gives the folder back. */
export function put(folder, files) {
  mkdirSync(folder, { recursive: true });
  for (const [path, data] of Object.entries(files)) {
    mkdirSync(dirname(join(folder, path)), { recursive: true });
    writeFileSync(join(folder, path), data);
  }
  return folder;
}

/** A zip of files as they are, not compressed. */
export function zip(files) {
  const parts = [];
  const directory = [];
  let offset = 0;
  for (const [path, content] of Object.entries(files)) {
    const [name, data] = [Buffer.from(path), Buffer.from(content)];
    const common = Buffer.alloc(26);
    common.writeUInt16LE(20, 0);
    common.writeUInt32LE(crc32(data), 10);
    common.writeUInt32LE(data.length, 14);
    common.writeUInt32LE(data.length, 18);
    common.writeUInt16LE(name.length, 22);
    parts.push(Buffer.from('PK\x03\x04', 'latin1'), common, name, data);
    const tail = Buffer.alloc(14);
    tail.writeUInt32LE(offset, 10);
    directory.push(Buffer.from('PK\x01\x02\x14\x00', 'latin1'), common, tail, name);
    offset += 30 + name.length + data.length;
  }
  const size = directory.reduce((total, { length }) => total + length, 0);
  const end = Buffer.alloc(18);
  end.writeUInt16LE(Object.keys(files).length, 4);
  end.writeUInt16LE(Object.keys(files).length, 6);
  end.writeUInt32LE(size, 8);
  end.writeUInt32LE(offset, 12);
  return Buffer.concat([...parts, ...directory, Buffer.from('PK\x05\x06', 'latin1'), end]);
}
