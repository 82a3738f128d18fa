// Voxels of a stack of layers. Twin of src/slicing.
const uint SLICE_PENDING = 0xfffffffeu; // centre located in no cell, box not looked at yet
const uint SLICE_LISTED = 0xfffffffdu;  // and on the list of boxes to look at
const uint SLICE_TOUCHED = 0x80000000u; // added to the owner of a voxel that is touched

vec3 voxel_centre(SlicePlan plan, uint x, uint y, uint layer) {
    precise vec3 at = ((plan.origin.xyz + float(layer) * plan.up.xyz) + float(y) * plan.down.xyz) + float(x) * plan.across.xyz;
    return at;
}
