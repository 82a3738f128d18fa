// Voxels of a stack of layers. Twin of src/slicing.
const uint SLICE_PENDING = 0xfffffffeu; // centre located in no cell, box not looked at yet
const uint SLICE_LISTED = 0xfffffffdu;  // and on the list of boxes to look at
const uint NAN = 0x7fc00000u; // value of an empty voxel
const uint SLICE_TOUCHED = 0x80000000u; // added to the owner of a voxel that is touched

// Place of voxel number i of the band: in its row, its row in the layer, its layer.
uvec3 voxel_place(SlicePlan plan, uint i) {
    uint row = i / plan.width, y = plan.first + row;
    return uvec3(i - row * plan.width, y % plan.height, plan.layer + y / plan.height);
}

// Where a row begins, and a voxel in it lies.
vec3 row_origin(SlicePlan plan, uint y, uint layer) {
    precise vec3 at = (plan.origin.xyz + float(layer) * plan.up.xyz) + float(y) * plan.down.xyz;
    return at;
}

vec3 voxel_centre(SlicePlan plan, vec3 row, uint x) {
    precise vec3 at = row + float(x) * plan.across.xyz;
    return at;
}

vec3 voxel_centre(SlicePlan plan, uint i) {
    uvec3 place = voxel_place(plan, i);
    return voxel_centre(plan, row_origin(plan, place.y, place.z), place.x);
}
