// A colour scale from blue over white to red, for values in [0, 1].
vec3 colour_of(float value) {
    float t = clamp(value, 0.0, 1.0);
    vec3 cold = vec3(0.13, 0.24, 0.62), middle = vec3(0.93, 0.92, 0.90), hot = vec3(0.70, 0.08, 0.12);
    return t < 0.5 ? mix(cold, middle, 2.0 * t) : mix(middle, hot, 2.0 * t - 1.0);
}
