// What hides parts of rays: clips, and what a depth buffer shows. Needs rays.glsl, grid.glsl, the constant DEPTH, and the
// globals `view`, `frames` and `depths`.

// How many steps from its origin the ray of a pixel, the `place`-th of the picture, is hidden.
float limit_of(uvec2 pixel, uint place) { return DEPTH != 0u ? steps_to_depth(view, pixel, depths.at[place]) : MAX_SAMPLES; }

// The stretch of a ray that no clip leaves out, and that lies within a limit, in steps from its origin, and the clip at
// which it begins, or NONE. Twin of `PicturePlan::kept_stretch`.
vec2 kept_stretch(vec3 origin, vec3 direction, float limit, out uint cut) {
    vec2 kept = vec2(0.0, limit);
    cut = NONE;
    for (uint i = 0u; i < min(view.clips, 4u); ++i) {
        vec4 plane = frames.at[0].view.clip[i]; // `view` would keep all of them in registers
        precise float before = plane.w - dot_product(plane.xyz, origin);
        float speed = dot_product(plane.xyz, direction);
        if (abs(speed) < LEAST) {
            kept.y = before < 0.0 ? -1.0 : kept.y;
            continue;
        }
        precise float way = before * reciprocal(speed);
        precise float steps = way * view.inverse_step;
        float at = clamp(steps, -1.0, MAX_SAMPLES);
        if (speed > 0.0) {
            kept.y = min(kept.y, at);
        } else if (at > kept.x) {
            kept.x = at;
            cut = i;
        }
    }
    return kept;
}
