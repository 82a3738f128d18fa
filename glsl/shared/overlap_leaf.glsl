// What the searches of the octree for tetrahedra that touch share. Needs grid.glsl and overlap.glsl.
layout(constant_id = 4) const uint EACH_ONCE = 1;
const uint BUDGET = 512u; // nodes and entries that one tetrahedron may visit in one dispatch

// Whether two tetrahedra are compared in the leaf with this code. With the assignment `Aabb` (EACH_ONCE), a pair is
// compared once: in the cell of the lower corner of the intersection of their boxes.
bool compared_in(Grid g, uint code, RawTet own, RawTet other) {
    if (!boxes_meet(own.lo, own.hi, other.lo, other.hi)) return false;
    if (EACH_ONCE == 0u) return true;
    return morton(quantize(g, max(own.lo, other.lo))) >> (3u * (MAX_LEVEL - g.level)) == code;
}
