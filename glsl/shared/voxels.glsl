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

vec3 voxel_centre(SlicePlan plan, uvec3 place) {
    precise vec3 at = ((plan.origin.xyz + float(place.z) * plan.up.xyz) + float(place.y) * plan.down.xyz) + float(place.x) * plan.across.xyz;
    return at;
}
