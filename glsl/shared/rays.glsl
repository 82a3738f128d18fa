// Rays of a picture. Twin of src/render/rays.rs, and of `inverse_sqrt` in src/render/mod.rs. Needs layout.glsl and
// tet.glsl.

// 1 / sqrt(x) of a normal x by correctly rounded operations only.
float inverse_sqrt(float x) {
    precise float r = uintBitsToFloat(0x5f3759dfu - (floatBitsToUint(x) >> 1));
    precise float h = x * 0.5;
    for (int i = 0; i < 4; ++i) {
        precise float hr = h * r;
        precise float hrr = hr * r;
        precise float f = 1.5 - hrr;
        r = r * f;
    }
    return r;
}

// The direction of a pixel's ray, of any length.
vec3 way_of(ViewUniforms view, uvec2 pixel) {
    vec2 at = vec2(pixel);
    precise vec3 w = (view.direction.xyz + at.x * view.direction_x.xyz) + at.y * view.direction_y.xyz;
    return w;
}

void make_ray(ViewUniforms view, uvec2 pixel, out vec3 origin, out vec3 direction) {
    vec2 at = vec2(pixel);
    precise vec3 o = (view.origin.xyz + at.x * view.origin_x.xyz) + at.y * view.origin_y.xyz;
    vec3 w = way_of(view, pixel);
    float r = inverse_sqrt(dot_product(w, w));
    precise vec3 d = w * r;
    origin = o;
    direction = d;
}

const float MOST = 1e30;   // Larger divisors of a depth count as infinite, so that their reciprocals are normal.
const float LEAST = 1e-20; // Smaller components of a ray's direction count as this, so that reciprocals are finite.

vec3 inverse_of(vec3 direction) {
    vec3 r;
    for (uint c = 0u; c < 3u; ++c) {
        bool parallel = abs(direction[c]) < LEAST;
        bool negative = (floatBitsToUint(direction[c]) & 0x80000000u) != 0u;
        r[c] = parallel ? (negative ? -1e20 : 1e20) : reciprocal(direction[c]);
    }
    return r;
}

// Most samples of a ray: beyond, k + 1/2 is not exact, and the march keeps flags in sample numbers from bit 30 on.
const float MAX_SAMPLES = 8388608.0;

// How many steps from its origin the ray of a pixel reaches value d of a depth buffer.
float steps_to_depth(ViewUniforms view, uvec2 pixel, float d) {
    precise float scale = view.origin_y.w + d * view.direction.w;
    bool finite = (floatBitsToUint(d) & 0x7f800000u) != 0x7f800000u; // by its bits: drivers may compare NaN as they like
    if (!finite || scale <= LEAST || scale >= MOST) return MAX_SAMPLES;
    vec3 w = way_of(view, pixel);
    float square = dot_product(w, w);
    precise float way = square * inverse_sqrt(square);
    precise float steps = (((view.origin.w + d * view.origin_x.w) * way) * reciprocal(scale)) * view.inverse_step;
    return steps < MAX_SAMPLES ? max(steps, -1.0) : MAX_SAMPLES;
}

// The position of sample k.
vec3 sample_at(ViewUniforms view, vec3 origin, vec3 direction, uint k) {
    precise float t = (float(k) + 0.5) * view.step_size;
    precise vec3 at = origin + direction * t;
    return at;
}

// The pixel of an item; false if it lies outside of the picture. Items take pixels in blocks of 8 × 8, and within a
// block along a Z curve, since neighbouring rays read neighbouring tetrahedra.
bool pixel_of(uint item, uvec2 size, out uvec2 pixel) {
    uint across = (size.x + 7u) / 8u;
    uint block = item / 64u, in_block = item % 64u;
    uvec2 corner = 8u * uvec2(block % across, block / across);
    pixel = corner + uvec2((in_block & 1u) | (in_block >> 1 & 2u) | (in_block >> 2 & 4u), (in_block >> 1 & 1u) | (in_block >> 2 & 2u) | (in_block >> 3 & 4u));
    return pixel.x < size.x && pixel.y < size.y;
}
