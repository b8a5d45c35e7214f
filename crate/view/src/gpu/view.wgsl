// What every shader of the renderer shares: the view, and the way to the target's encoding.

struct View {
    clip_from_world: mat4x4f,
    eye_m: vec3f,
    // 0 colour, 1 normal, 2 depth, 3 wireframe, 4 confidence, 5 views
    shading: u32,
    forward: vec3f,
    // 1 where the target encodes sRGB itself and wants linear light
    target_is_srgb: u32,
    viewport_px: vec2f,
    // view depths at the ends of the ramp
    depth_range_m: vec2f,
    // sRGB; a: device pixels per CSS pixel
    wire: vec4f,
    background: vec4f,
    // sRGB; a: doublings of views along the ramp
    unknown: vec4f,
    // far to near or low to high, sRGB
    ramp: array<vec4f, 9>,
}

@group(0) @binding(0) var<uniform> view: View;

// Colours are mixed as sRGB values, as browsers do; only an sRGB target needs them linear.
fn present(srgb: vec3f) -> vec3f {
    if view.target_is_srgb == 1u {
        return select(
            pow((srgb + 0.055) / 1.055, vec3f(2.4)),
            srgb / 12.92,
            srgb <= vec3f(0.04045),
        );
    }
    return srgb;
}
