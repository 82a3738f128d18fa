// Seeds of unmarked cells (SPEC 2.6). Twin of src/reference/marks.rs, which explains them. Needs marks.glsl,
// cells.glsl, centre.glsl and best_owner.glsl.

// The candidates of a tetrahedron whose centre its own box contains: from lo to hi, inclusive; none if hi is less than
// lo. Along each axis, only the first and the last candidate can have their centre outside.
struct Centres {
    ivec3 lo;
    ivec3 hi;
};

// The centre of a cell of the tree's level.
vec3 centre_of(Grid g, uvec3 cell) { return cell_shape(g, g.level, cell).centre; }

Centres centres_of(Tet tet, Grid g, CellBox box) {
    vec3 lo = min(min(tet.v[0], tet.v[1]), min(tet.v[2], tet.v[3])), hi = max(max(tet.v[0], tet.v[1]), max(tet.v[2], tet.v[3]));
    uvec3 last = box.lo + box.size - 1u;
    Centres c;
    c.lo = ivec3(box.lo) + ivec3(lessThan(centre_of(g, box.lo), lo));
    c.hi = ivec3(last) - ivec3(greaterThan(centre_of(g, last), hi));
    return c;
}

// Of n candidates from `at` on: which are marked, and which of the others have their centre in the box of the
// tetrahedron.
void sift(uint level, CellBox box, uvec3 at, uint n, Centres c, out uint marked, out uint centres) {
    marked = centres = 0u;
    for (uint i = 0u; i < n;) {
        uint run = min(n - i, box.lo.x + box.size.x - at.x);
        uint row = marked_row(level, at, run);
        marked |= row << i;
        int x = int(at.x), y = int(at.y), z = int(at.z);
        int from = max(c.lo.x - x, 0), to = min(c.hi.x - x, int(run) - 1);
        bool any = from <= to && c.lo.y <= y && y <= c.hi.y && c.lo.z <= z && z <= c.hi.z;
        if (any) centres |= (low_bits(uint(to + 1)) & ~low_bits(uint(from)) & ~row) << i;
        i += run;
        at.x += run - 1u;
        at = next_candidate(box, at);
    }
}

// Whether a centre is neither clearly inside nor clearly outside.
bool in_doubt(Weights own) { return !own.clear && own.in_box && near(own); }
