// Lines of a given width in pixels: each one is a quad that faces the screen.

struct Stroke {
    @builtin(position) clip: vec4f,
    @location(0) colour: vec4f,
}

// As camera.rs has it.
const NEAR_M = 0.02;

@vertex
fn stroke(
    @builtin(vertex_index) index: u32,
    @location(0) from_m: vec3f,
    @location(1) width_px: f32,
    @location(2) to_m: vec3f,
    @location(3) from_colour: vec4f,
    @location(4) to_colour: vec4f,
) -> Stroke {
    var ends = array(
        view.clip_from_world * vec4f(from_m, 1.0),
        view.clip_from_world * vec4f(to_m, 1.0),
    );
    // A quad cannot be spread around an end behind the eye: cut the line at the near plane first.
    let gap = ends[1].w - ends[0].w;
    if ends[0].w < NEAR_M && ends[1].w >= NEAR_M {
        ends[0] = mix(ends[0], ends[1], (NEAR_M - ends[0].w) / gap);
    } else if ends[1].w < NEAR_M && ends[0].w >= NEAR_M {
        ends[1] = mix(ends[0], ends[1], (NEAR_M - ends[0].w) / gap);
    }
    let along = (ends[1].xy / ends[1].w - ends[0].xy / ends[0].w) * view.viewport_px;
    let aside = vec2f(-along.y, along.x) / max(length(along), 1e-6);

    // Two triangles: from-, from+, to-, to-, from+, to+.
    let at_to = index == 2u || index == 3u || index == 5u;
    let side = select(-1.0, 1.0, index == 1u || index >= 4u);
    var clip = select(ends[0], ends[1], at_to);
    let spread = aside * side * width_px * view.wire.a / view.viewport_px;
    clip += vec4f(spread * clip.w, 0.0, 0.0);
    return Stroke(clip, select(from_colour, to_colour, at_to));
}

@fragment
fn line(at: Stroke) -> @location(0) vec4f {
    return vec4f(present(at.colour.rgb), at.colour.a);
}
