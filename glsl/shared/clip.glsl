// Clips of a picture. Needs rays.glsl, grid.glsl, and the globals `view` and `frames`.

// The stretch of a ray that no clip leaves out, in steps from its origin, and the clip at which it begins, or NONE. Twin of
// `Plan::kept_stretch`.
vec2 kept_stretch(vec3 origin, vec3 direction, out uint cut) {
    vec2 kept = vec2(0.0, MAX_SAMPLES);
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
