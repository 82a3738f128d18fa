// The part of wgpu in a frame: it moves the points of the body before the tree is built, and draws the results at the
// pixels of a cut.

struct Frame {
    centre: vec3f,
    radius: f32,
    swing: f32,
    width: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

@group(0) @binding(1) var<storage, read> rest: array<f32>;
@group(0) @binding(2) var<storage, read_write> positions: array<f32>;

@compute @workgroup_size(64)
fn deform(@builtin(global_invocation_id) id: vec3u) {
    let i = 3 * id.x;
    if i + 2 >= arrayLength(&rest) {
        return;
    }
    let x = vec3f(rest[i], rest[i + 1], rest[i + 2]) - frame.centre;
    let angle = 0.6 * frame.swing * x.y / frame.radius;
    let sway = 0.12 * frame.radius * frame.swing * sin(2.5 * x.x / frame.radius);
    positions[i] = frame.centre.x + cos(angle) * x.x - sin(angle) * x.z;
    positions[i + 1] = frame.centre.y + x.y;
    positions[i + 2] = frame.centre.z + sin(angle) * x.x + cos(angle) * x.z + sway;
}

@group(0) @binding(3) var<storage, read> owners: array<u32>;
@group(0) @binding(4) var<storage, read> values: array<f32>;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1) * 4.0 - 1.0, f32(i & 2) * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn colour(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let i = u32(at.y) * frame.width + u32(at.x);
    let owner = owners[i];
    if owner == 0xffffffffu {
        return vec4f(0.08, 0.09, 0.11, 1.0);
    }
    let t = values[i];
    let colour = mix(mix(vec3f(0.1, 0.2, 0.6), vec3f(0.9, 0.85, 0.7), min(2.0 * t, 1.0)), vec3f(0.75, 0.1, 0.1), max(2.0 * t - 1.0, 0.0));
    // Darkens the edges of the tetrahedra.
    let last = arrayLength(&owners) - 1;
    let edge = owners[min(i + 1, last)] != owner || owners[min(i + frame.width, last)] != owner;
    return vec4f(select(colour, 0.75 * colour, edge), 1.0);
}
