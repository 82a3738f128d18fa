// Voxels of a stack of layers. Twin of src/slicing. Needs grid.glsl.
const uint SLICE_PENDING = 0xfffffffeu; // the centre lies in no tetrahedron, and the box has not been tested yet
const uint NAN = 0x7fc00000u; // value of an empty voxel
const uint SLICE_TOUCHED = 0x80000000u; // Added to the owner of a voxel that is only touched.
// Most voxels of a run: voxels of a column of a layer whose centres are located one after the other, each from the
// owner of the one before.
const uint VOXEL_RUN = 64u;

// Row number i of the band: its number within its layer, and the layer.
uvec2 voxel_row(SliceUniforms plan, uint i) {
    uint y = plan.first + i;
    return uvec2(y % plan.height, plan.layer + y / plan.height);
}

// The rows of run number i of a band of `rows` rows: the first of them, and their number. Twin of `Rows::run`.
uvec2 rows_of_run(uint rows, uint height, uint i) {
    uint most = min(rows, height), runs = (most + VOXEL_RUN - 1u) / VOXEL_RUN, layer = i / runs * most, begin = (i % runs) * VOXEL_RUN;
    uint end = min(rows, layer + min(most, begin + VOXEL_RUN));
    return uvec2(layer + begin, end - min(end, layer + begin));
}

vec3 canonical_each(vec3 v) { return vec3(canonical(v.x), canonical(v.y), canonical(v.z)); }

// The place `n` steps from another. Denormals, which devices may flush, count as 0.
vec3 steps_from(vec3 at, uint n, vec3 each) {
    precise vec3 way = float(n) * canonical_each(each);
    precise vec3 there = at + canonical_each(way);
    return canonical_each(there);
}

// The centre of the first voxel of a row.
vec3 row_origin(SliceUniforms plan, uvec2 row) {
    return steps_from(steps_from(canonical_each(plan.origin.xyz), row.y, plan.next_layer.xyz), row.x, plan.next_row.xyz);
}

// The centre of voxel x of the row that starts at `row`.
vec3 voxel_centre(SliceUniforms plan, vec3 row, uint x) { return steps_from(row, x, plan.next_voxel.xyz); }

// The centre of voxel number i of the band.
vec3 voxel_centre(SliceUniforms plan, uint i) {
    uint row = i / plan.width;
    return voxel_centre(plan, row_origin(plan, voxel_row(plan, row)), i - row * plan.width);
}
