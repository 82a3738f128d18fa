// The structs by which shaders of other programs, too, know a tree.

// The grid of a mesh (SPEC 2.1).
struct Grid {
    vec4 lo;      // Lower corner of the bounds.
    vec4 hi;      // Upper corner of the bounds.
    vec4 inv;     // Finest cells per unit of length, 0 on a flat axis.
    vec4 extent;  // Upper corner in normalised coordinates.
    float scale;  // Power of two that brings the largest extent into [1, 2).
    uint level;   // Level of the leaves, l.
    uint first_leaf; // Node index of the first leaf, n_ni.
    uint ids;     // Bits of an entry of P that hold its tetrahedron; the bits above are its quarters, if there are any.
    uint slabs;   // Word of PO where the slabs of the leaves begin; 0: there are none.
    uint longest; // Entries of the longest leaf.
    uint graded;  // Not 0: cells are smaller where the mesh has more tetrahedra, see src/mesh/grading.rs.
    uint pad;     // Unused.
    vec4 knots[17]; // If it is graded: where the stretches of each axis begin, as distances from `lo`, and the extent.
    vec4 rates[16]; // If it is graded: finest cells per unit of length in each stretch, 0 on a flat axis.
};

// Device addresses of a mesh and its tree, for the shaders of other programs, low word first. See src/glsl.rs.
struct SceneAddresses {
    uvec2 grid;       // Grid with the level of the leaves.
    uvec2 masks;      // Child masks.
    uvec2 co;         // Child offsets.
    uvec2 po;         // Offsets of the leaves in `p`, and the slabs of the leaves.
    uvec2 p;          // Entries: ids of tetrahedra, and their quarters above them.
    uvec2 flags;      // Boundary flags.
    uvec2 cells;      // Vertex indices.
    uvec2 vertices;   // Normalised coordinates.
    uvec2 neighbours; // Neighbour table.
    uvec2 field;      // One float per point; any address if there is no field.
    uint lists;       // 1: leaves within the mesh have a seed instead of a list.
    uint has_field;   // Not 0: there is a field.
};
