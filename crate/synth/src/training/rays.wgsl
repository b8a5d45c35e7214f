// What each pixel's ray meets and the light that arrives there: `look` and `arriving` of light.rs and render.rs, on the
// GPU, a pixel an invocation. Surfaces' patterns stay on the processor.

struct Node { low: vec3f, first: u32, high: vec3f, count: u32 }

struct Solid {
    // Block: half sizes and rounding. Drum: bottom and top radius, half height, rounding.
    size: vec4f,
    // Middle, and 0 for a sharp block, 1 for a rounded one, 2 for a drum.
    center: vec4f,
    // The axes in the room; the fourth numbers are half the size of the box around.
    x: vec4f,
    y: vec4f,
    z: vec4f,
    // Mean tone, and bits: 1 casts shadows, 2 is glossy.
    tone: vec4f,
}

struct Light { center: vec4f, u: vec4f, v: vec4f, facing: vec4f, power: vec4f }

struct Area { corners: vec4f, ambient: vec4f }

struct View { right: vec4f, down: vec4f, ahead: vec4f, position: vec4f, lens: vec4f }

struct Probe { dir: vec4f, spot: vec4f }

struct Counts { width: u32, height: u32, lights: u32, areas: u32 }

struct Scene {
    counts: Counts,
    probes: array<Probe, 64>,
    lights: array<Light, 10>,
    areas: array<Area, 8>,
    views: array<View>,
}

@group(0) @binding(0) var<storage, read> nodes: array<Node>;
@group(0) @binding(1) var<storage, read> solids: array<Solid>;
@group(0) @binding(2) var<storage, read> scene: Scene;
@group(0) @binding(3) var<storage, read_write> result: array<u32>;

const NONE = 0xffffffffu;
const FAR_M = 100.0;
const AWAY_M = 1e-3;
const ON_SURFACE_M = 1e-5;
const FAINT = 0.01;
const BRIGHTEST = 4.0;
const GUESS = 1e-3;
const SMALL_M = 0.03;
const WORDS = 10u;

struct Field { gap: f32, slope: vec3f }

fn sign_of(v: vec3f) -> vec3f {
    return select(vec3f(-1.0), vec3f(1.0), v >= vec3f(0.0));
}

fn block_field(p: vec3f, half: vec3f, round: f32) -> Field {
    let q = abs(p) - half;
    let out = max(q, vec3f(0.0));
    let len = length(out);
    if len > 1e-9 {
        return Field(len - round, out / len * sign_of(p));
    }
    let d = max(q.x, max(q.y, q.z));
    var axis = vec3f(0.0, 0.0, 1.0);
    if d == q.x { axis = vec3f(1.0, 0.0, 0.0); } else if d == q.y { axis = vec3f(0.0, 1.0, 0.0); }
    return Field(d - round, axis * sign_of(p));
}

fn drum_field(p: vec3f, bottom: f32, top: f32, half: f32) -> Field {
    let radius = length(p.xy);
    var outward = vec3f(1.0, 0.0, 0.0);
    if radius > 1e-9 { outward = vec3f(p.xy / radius, 0.0); }
    let slope = vec2f(top - bottom, 2.0 * half);
    let side = vec2f(slope.y, -slope.x) / length(slope);
    let from_bottom = vec2f(radius - bottom, p.z + half);
    let beside = dot(from_bottom, side);
    let above = abs(p.z) - half;
    let cap = select(bottom, top, p.z > 0.0);
    let up = vec3f(0.0, 0.0, select(-1.0, 1.0, p.z >= 0.0));
    let tilt = outward * side.x + vec3f(0.0, 0.0, side.y);
    if beside <= 0.0 && above <= 0.0 {
        if beside > above { return Field(beside, tilt); }
        return Field(above, up);
    }
    if above > 0.0 && radius <= cap { return Field(above, up); }
    let along = dot(from_bottom, slope) / dot(slope, slope);
    if along >= 0.0 && along <= 1.0 { return Field(beside, tilt); }
    let away = select(from_bottom, from_bottom - slope, along > 0.5);
    let d = length(away);
    if d < 1e-9 { return Field(0.0, up); }
    return Field(d, outward * (away.x / d) + vec3f(0.0, 0.0, away.y / d));
}

fn field(size: vec4f, kind: f32, p: vec3f) -> Field {
    if kind > 1.5 {
        let drum = drum_field(p, size.x, size.y, size.z);
        return Field(drum.gap - size.w, drum.slope);
    }
    return block_field(p, size.xyz, size.w);
}

struct Touch { t: f32, normal: vec3f }

// `Solid::cast` of solid.rs; t is negative where the ray misses.
fn touch(index: u32, origin: vec3f, dir: vec3f, limit: f32) -> Touch {
    let miss = Touch(-1.0, vec3f(0.0));
    let x = solids[index].x;
    let y = solids[index].y;
    let z = solids[index].z;
    let center = solids[index].center;
    let away = origin - center.xyz;
    let o = vec3f(dot(x.xyz, away), dot(y.xyz, away), dot(z.xyz, away));
    var d = vec3f(dot(x.xyz, dir), dot(y.xyz, dir), dot(z.xyz, dir));
    d = select(d, vec3f(1e-12), abs(d) < vec3f(1e-12));
    let half = vec3f(x.w, y.w, z.w);
    let way = sign_of(d);
    let near = (-half * way - o) / d;
    let far = (half * way - o) / d;
    let enter = max(near.x, max(near.y, near.z));
    let leave = min(far.x, min(far.y, far.z));
    if enter > leave || leave < 0.0 || enter >= limit { return miss; }
    if center.w < 0.5 {
        if enter < 0.0 { return miss; }
        if enter == near.x { return Touch(enter, -way.x * x.xyz); }
        if enter == near.y { return Touch(enter, -way.y * y.xyz); }
        return Touch(enter, -way.z * z.xyz);
    }
    let size = solids[index].size;
    var t = max(enter, 0.0);
    for (var step = 0; step < 24; step++) {
        let here = field(size, center.w, o + d * t);
        let slope = dot(here.slope, d);
        if step == 0 && here.gap < 0.0 && enter < 0.0 || slope > -1e-6 { return miss; }
        if here.gap < ON_SURFACE_M {
            return Touch(t, x.xyz * here.slope.x + y.xyz * here.slope.y + z.xyz * here.slope.z);
        }
        t -= here.gap / slope;
        if t > leave || t >= limit { return miss; }
    }
    return miss;
}

fn enter_box(index: u32, origin: vec3f, inverse: vec3f) -> f32 {
    let a = (nodes[index].low - origin) * inverse;
    let b = (nodes[index].high - origin) * inverse;
    let low = min(a, b);
    let high = max(a, b);
    let near = max(max(low.x, low.y), max(low.z, 0.0));
    return select(1e30, near, near <= min(high.x, min(high.y, high.z)));
}

struct Hit { t: f32, solid: u32, normal: vec3f }

// The nearest hit; or, with `shadow`, whether something that casts a shadow is hit at all.
fn first_hit(origin: vec3f, dir: vec3f, reach: f32, shadow: bool) -> Hit {
    var hit = Hit(reach, NONE, vec3f(0.0));
    let inverse = 1.0 / select(dir, vec3f(1e-12), abs(dir) < vec3f(1e-12));
    var stack: array<u32, 40>;
    var nears: array<f32, 40>;
    stack[0] = 0u;
    nears[0] = 0.0;
    var height = 1u;
    while height > 0u {
        height--;
        if nears[height] >= hit.t { continue; }
        let at = stack[height];
        let first = nodes[at].first;
        let count = nodes[at].count;
        if count > 0u {
            for (var i = first; i < first + count; i++) {
                if shadow && (u32(solids[i].tone.w) & 1u) == 0u { continue; }
                let found = touch(i, origin, dir, hit.t);
                if found.t >= 0.0 {
                    hit = Hit(found.t, i, found.normal);
                    if shadow { return hit; }
                }
            }
            continue;
        }
        let left = enter_box(first, origin, inverse);
        let right = enter_box(first + 1u, origin, inverse);
        let left_first = left < right;
        let far = max(left, right);
        let close = min(left, right);
        if far < hit.t {
            stack[height] = first + select(0u, 1u, left_first);
            nears[height] = far;
            height++;
        }
        if close < hit.t {
            stack[height] = first + select(1u, 0u, left_first);
            nears[height] = close;
            height++;
        }
    }
    return hit;
}

fn ambient_at(p: vec3f) -> vec3f {
    for (var i = 0u; i < scene.counts.areas; i++) {
        let corners = scene.areas[i].corners;
        if all(p.xy >= corners.xy) && all(p.xy <= corners.zw) { return scene.areas[i].ambient.xyz; }
    }
    return scene.areas[0].ambient.xyz;
}

// Light of one lamp without shadows, and the way to it; the power at that distance for highlights.
struct Fall { light: vec3f, power: vec3f, to: vec3f }

fn fall(index: u32, at: vec3f, normal: vec3f, spot: vec2f) -> Fall {
    let light = scene.lights[index];
    let to = light.center.xyz + light.u.xyz * spot.x + light.v.xyz * spot.y - at;
    let all_round = dot(light.facing.xyz, light.facing.xyz) == 0.0;
    let facing = select(-dot(to, light.facing.xyz), 1.0, all_round);
    let cosine = dot(to, normal);
    if facing <= 0.0 || cosine <= 0.0 { return Fall(vec3f(0.0), vec3f(0.0), to); }
    let square = dot(to, to);
    let away = sqrt(square);
    let given = select(0.15 + 0.85 * facing / away, 1.0, all_round);
    let power = light.power.xyz * (given / (0.12 + 0.6 * light.power.w + square));
    return Fall(power * (cosine / away), power, to);
}

fn largest(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn strongest(at: vec3f, normal: vec3f) -> vec3f {
    var best = Fall(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    var most = 0.0;
    for (var i = 0u; i < scene.counts.lights; i++) {
        let one = fall(i, at, normal, vec2f(0.0));
        let sum = one.light.x + one.light.y + one.light.z;
        if sum > most {
            most = sum;
            best = one;
        }
    }
    if most == 0.0 { return vec3f(0.0); }
    let away = length(best.to);
    if first_hit(at, best.to / away, away, true).solid != NONE { return vec3f(0.0); }
    return best.light;
}

fn pair(a: f32, b: f32) -> u32 {
    return pack2x16float(min(vec2f(a, b), vec2f(60000.0)));
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let counts = scene.counts;
    if id.x >= counts.width || id.y >= counts.height { return; }
    let slot = ((id.z * counts.height + id.y) * counts.width + id.x) * WORDS;
    let view = scene.views[id.z];
    let plane = (vec2f(id.xy) - view.lens.zw) / view.lens.xy;
    let dir = normalize(view.right.xyz * plane.x + view.down.xyz * plane.y + view.ahead.xyz);
    let hit = first_hit(view.position.xyz, dir, FAR_M, false);
    if hit.solid == NONE {
        result[slot] = 0u;
        return;
    }
    let normal = hit.normal;
    let at = view.position.xyz + dir * hit.t;
    let origin = at + normal * AWAY_M;
    let probe = scene.probes[(id.y % 8u) * 8u + id.x % 8u];
    let ambient = ambient_at(at);
    let glossy = (u32(solids[hit.solid].tone.w) & 2u) != 0u;
    var crisp = vec3f(0.0);
    var soft = vec3f(0.0);
    var shine = vec3f(0.0);
    for (var i = 0u; i < counts.lights; i++) {
        let one = fall(i, origin, normal, probe.spot.xy);
        if largest(one.light) <= 0.0 || largest(one.light) < FAINT * largest(ambient) { continue; }
        let away = length(one.to);
        if first_hit(origin, one.to / away, away, true).solid != NONE { continue; }
        if scene.lights[i].power.w < SMALL_M * SMALL_M { crisp += one.light; } else { soft += one.light; }
        if glossy {
            let halfway = normalize(one.to / away - dir);
            let h = pow(max(dot(halfway, normal), 0.0), 64.0);
            let low = 1.0 + clamp(dot(dir, normal), -1.0, 0.0);
            shine += one.power * (h * (0.5 + 2.0 * low * low));
        }
    }
    var around = ambient;
    var certainty = GUESS;
    if (id.x % 8u + id.y % 8u) % 2u == 0u {
        let side = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 0.0, 1.0), abs(normal.z) < 0.9);
        let x = normalize(cross(side, normal));
        let y = cross(normal, x);
        let way = x * probe.dir.x + y * probe.dir.y + normal * probe.dir.z;
        let other = first_hit(origin, way, FAR_M, false);
        certainty = 1.0;
        if other.solid != NONE {
            let there = origin + way * other.t + other.normal * AWAY_M;
            let back = ambient_at(there);
            let given = solids[other.solid].tone.xyz * (strongest(there, other.normal) + back);
            around = min(given, vec3f(BRIGHTEST * largest(ambient)));
        }
    }
    result[slot] = bitcast<u32>(hit.t);
    result[slot + 1u] = hit.solid;
    result[slot + 2u] = pack2x16snorm(normal.xy);
    result[slot + 3u] = pack2x16snorm(vec2f(normal.z, certainty));
    result[slot + 4u] = pair(crisp.x, crisp.y);
    result[slot + 5u] = pair(crisp.z, soft.x);
    result[slot + 6u] = pair(soft.y, soft.z);
    result[slot + 7u] = pair(shine.x, shine.y);
    result[slot + 8u] = pair(shine.z, around.x);
    result[slot + 9u] = pair(around.y, around.z);
}
