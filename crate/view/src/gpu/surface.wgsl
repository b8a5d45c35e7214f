// The mesh: triangle soup as marching cubes writes it (`mesh::soup` has the packing).

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) world_m: vec3f,
    @location(1) normal: vec3f,
    @location(2) srgb: vec3f,
    @location(3) barycentric: vec3f,
    // views, confidence, and 1 where there is one
    @location(4) evidence: vec3f,
}

fn fold(p: vec2f) -> vec2f {
    return (1.0 - abs(p.yx)) * select(vec2f(1.0), vec2f(-1.0), p < vec2f(0.0));
}

fn unpack_normal(packed: f32) -> vec3f {
    let u = floor(packed / 4096.0);
    let p = vec2f(u, packed - u * 4096.0) / 4095.0 * 2.0 - 1.0;
    let z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3f(select(p, fold(p), z < 0.0), z));
}

fn unpack_srgb(packed: f32) -> vec3f {
    let bits = u32(packed);
    return vec3f(f32(bits >> 16u), f32((bits >> 8u) & 255u), f32(bits & 255u)) / 255.0;
}

fn unpack_evidence(key: f32) -> vec3f {
    let bits = u32(key) >> 12u;
    let level = f32(bits & 63u);
    return vec3f(f32(bits >> 6u), max(level - 1.0, 0.0) / 62.0, min(level, 1.0));
}

@vertex
fn corner(
    @builtin(vertex_index) index: u32,
    @location(0) position_m: vec3f,
    @location(1) normal: f32,
    @location(2) colour: f32,
    @location(3) key: f32,
) -> Corner {
    let k = index % 3u;
    return Corner(
        view.clip_from_world * vec4f(position_m, 1.0),
        position_m,
        unpack_normal(normal),
        unpack_srgb(colour),
        vec3f(f32(k == 0u), f32(k == 1u), f32(k == 2u)),
        unpack_evidence(key),
    );
}

// A headlight and a sky, at most 1: captured colours already hold the room's own light.
fn light(normal: vec3f, to_eye: vec3f) -> f32 {
    let head = max(dot(normal, to_eye), 0.0);
    return 0.3 + 0.45 * head + 0.25 * (normal.z * 0.5 + 0.5);
}

fn ramp(share: f32) -> vec3f {
    let t = clamp(share, 0.0, 1.0) * 8.0;
    let stop = min(u32(t), 7u);
    return mix(view.ramp[stop].rgb, view.ramp[stop + 1u].rgb, t - f32(stop));
}

fn of_depth(depth_m: f32) -> vec3f {
    let span = view.depth_range_m.y - view.depth_range_m.x;
    return ramp((view.depth_range_m.y - depth_m) / span);
}

// Between corners with and without confidence it is that of those that have one.
fn of_evidence(evidence: vec3f) -> vec3f {
    let of_views = view.shading == 5u;
    let confidence = evidence.y / max(evidence.z, 0.5);
    let share = select(confidence, log2(max(evidence.x, 1.0)) / view.unknown.a, of_views);
    let known = select(evidence.z, evidence.x, of_views) >= 0.5;
    return select(view.unknown.rgb, ramp(share), known);
}

// 1 on an edge, fading over one pixel; an even tint where triangles are too small to tell apart.
fn edge(barycentric: vec3f) -> f32 {
    let per_px = fwidth(barycentric);
    let reach = smoothstep(vec3f(0.0), per_px * 1.3 * view.wire.a, barycentric);
    let line = 1.0 - min(reach.x, min(reach.y, reach.z));
    let crowd = max(per_px.x, max(per_px.y, per_px.z));
    return mix(line, 0.35, smoothstep(0.2, 0.7, crowd));
}

@fragment
fn surface(at: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let normal = select(-1.0, 1.0, front) * normalize(at.normal);
    if view.shading == 1u {
        return vec4f(present(normal * 0.5 + 0.5), 1.0);
    }
    let to_world = at.world_m - view.eye_m;
    if view.shading == 2u {
        return vec4f(present(of_depth(dot(to_world, view.forward))), 1.0);
    }
    // Light scales linear values; on sRGB values that is its 1/2.2th power.
    let shade = pow(light(normal, -normalize(to_world)), 1.0 / 2.2);
    if view.shading >= 4u {
        // Little of it: shape shows, and colours stay those of the legend.
        let value = of_evidence(at.evidence);
        return vec4f(present(value * mix(1.0, shade, 0.4)), 1.0);
    }
    let lit = at.srgb * shade;
    if view.shading == 3u {
        let soft = mix(lit, view.background.rgb, 0.25);
        return vec4f(present(mix(soft, view.wire.rgb, 0.6 * edge(at.barycentric))), 1.0);
    }
    return vec4f(present(lit), 1.0);
}

// Picking: how far ahead the surface is.
@fragment
fn view_depth_m(at: Corner) -> @location(0) vec4f {
    return vec4f(dot(at.world_m - view.eye_m, view.forward), 0.0, 0.0, 1.0);
}
