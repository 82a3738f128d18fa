// Every struct that host and device share; build.rs reflects this file into src/layout.rs, comments included.

// The grid of a mesh (SPEC 2.1).
struct Grid {
    vec4 lo;      // Lower corner of the bounds.
    vec4 hi;      // Upper corner of the bounds.
    vec4 inv;     // Finest cells per unit of length, 0 on a flat axis.
    vec4 extent;  // Upper corner in normalised coordinates.
    float scale;  // Power of two that brings the largest extent into [1, 2).
    uint level;   // Level of the leaves, l.
    uint first_leaf; // Node index of the first leaf, n_ni.
    uint ids;     // Bits of an entry of P that are its primitive; those above are its quarters, if there are any.
};

// What is known of a mesh once it lies on the device (SPEC 2.1, 2.3). Counters are zeroed before use.
struct MeshStatus {
    uint lo[3];     // Lower corner of the bounds as ordered keys (complemented, so that zeroes mean nothing seen).
    uint hi[3];     // Upper corner of the bounds as ordered keys.
    uint bad;       // Tetrahedra left out: index out of range, repeated vertex, coordinate not finite.
    uint boundary;  // Boundary tetrahedra.
    uint zero_volume; // Tetrahedra of zero volume.
    uint negative;  // Tetrahedra of negative volume in the caller's order of vertices.
    uint overflow;  // Not 0: the table of faces was too small; never happens with the planned size.
    uint pad;       // Unused.
};

// What a build made (SPEC 2.4, 2.5).
struct BuildStatus {
    uint level;            // Level of the leaves, l.
    uint heuristic_level;  // Level that the heuristic chose; above `level` where a capacity clipped it.
    uint candidates;       // Cells within the quantized boxes of all tetrahedra, the entries of `Aabb`.
    uint entries;          // n_m.
    uint nodes;            // n_n.
    uint internal;         // n_ni.
    uint leaves;           // Nodes on the last level.
    uint boundary_leaves;  // Leaves with the boundary flag.
    uint longest_leaf;     // Entries of the longest leaf.
    uint pad;              // Unused.
    uint sum[2];           // Sum of the estimates of Eq. 11, low word first.
    uint total[22];        // Entries of `Aabb` on every level, low word first.
    uint levels[11];       // NO: nodes on levels 0 to k.
    uint overflow;         // Not 0: a capacity was exceeded, which a planned one never is, or a budget is below the root alone.
};

// What is seen and how, besides mesh, tree and field; see src/render.
struct RenderView {
    vec4 origin;     // Origin of the ray of pixel (0, 0).
    vec4 origin_x;   // What one pixel to the right adds to it.
    vec4 origin_y;   // What one pixel down adds to it.
    vec4 direction;        // Direction of the ray of pixel (0, 0), of any length.
    vec4 direction_x;      // What one pixel to the right adds to it.
    vec4 direction_y;      // What one pixel down adds to it.
    vec4 to_light;   // Unit vector to the light.
    vec4 strength;   // Of light: ambient, diffuse, specular; opacity of one step at a rim.
    float step_size; // Distance of two samples.
    float inverse_step; // Its reciprocal, rounded on the host.
    float value_lo;  // Value at place 0 of the table.
    float value_scale; // Places per unit of value.
    float termination; // A ray ends once it is this opaque.
    uint isos;       // Values of iso-surfaces.
    uint pad[2];     // Unused.
    float iso[8];    // Those values, ascending.
};

// What is worked out of a view on the device.
struct RenderPlan {
    vec4 slack;      // Boxes are larger by this, so that rounding loses no sample.
    uint size[2];    // Width and height in pixels.
    uint visible_at; // Words of the flags before the marks of visible nodes, where there are any.
    uint row;        // Row of the view that is the first one here.
    uint first_cell; // The first cell of the finest grid whose samples are taken, 10 bits per axis, x lowest.
    uint last_cell;  // The last one; between them lies a block of the mesh, or all of it.
    uint pad[2];     // Unused.
};

// Where the march of a ray stands between two dispatches.
struct RayState {
    uint next;      // Number of the next sample.
    uint end;       // One past the last sample.
    uint hint;      // Cell of the last sample found, or all ones.
    uint cursor;    // Entries of the leaf's list already searched for the next sample.
    uint best;      // Best candidate among them, or all ones.
    float smallest; // Its smallest barycentric coordinate.
    uint last;      // Bits of the value at the last sample, for iso-surfaces; all ones where it has none.
    uint check;     // From this sample on the tree is asked whether there is anything to see; the two top bits, which no sample needs, tell of the best candidate.
};

// Counters of a picture; 64 bits as two words, low first.
struct RenderStatus {
    uint samples[2]; // Samples taken.
    uint found[2];   // Samples in the mesh.
    uint skipped[2]; // Samples not taken, in nodes where nothing is to be seen.
    uint unfinished; // Rays that need another round.
    uint pad;        // Unused.
};

// A node of the binary tree of the baseline (Apetrei 2014): internal node i splits the sorted primitives behind place i. References to children: bit 31
// says that the rest is a place in the sorted primitives, bit 30 that a boundary primitive is below, the rest is an internal node or that place.
struct LbvhNode {
    float lo[3];   // Lower corner of the box in normalised coordinates.
    uint left;     // Reference to the left child.
    float hi[3];   // Upper corner of the box.
    uint right;    // Reference to the right child.
};

// A stack of layers of voxels over a mesh; see src/slicing.
struct SlicePlan {
    uint listed; // Voxels of the band whose centre lies in no cell. First of all, since it is bound by itself.
    uint pad0;   // Unused.
    uint pad1;   // Unused.
    uint pad2;   // Unused.
    vec4 origin; // Centre of voxel (0, 0) of layer 0.
    vec4 across; // From one voxel of a row to the next.
    vec4 down;   // From one row to the next.
    vec4 up;     // From one layer to the next.
    vec4 half0;  // Half axis of a voxel's box in normalised coordinates, along the row.
    vec4 half1;  // The same from row to row.
    vec4 half2;  // The same from layer to layer.
    vec4 reach;  // Half extent of a voxel's box along the axes in the units of the mesh, and a little more.
    uint width;  // Voxels per row.
    uint height; // Rows of a layer.
    uint layer;  // Layer of the first row of the band: those rows that are sliced now.
    uint first;  // Number of that row in the layer.
    uint rows;   // Rows of the band.
    uint refused; // 1: boxes are flat; 2: they are more than twice as large as the mesh; else 0.
    uint first_cell; // The first cell of the finest grid that is looked at, 10 bits per axis, x lowest.
    uint last_cell;  // The last one; between them lies a block of the mesh, or all of it.
};

// Where the search for the primitive closest to a voxel stands between two dispatches.
struct TouchState {
    uint code;    // Morton code of the leaf to go on with; all ones: done.
    uint entry;   // Entries of that leaf already seen.
    uint owner;   // Closest primitive so far, or all ones.
    float square; // Its squared distance.
    uint voxel;   // Number of the voxel in the band.
};

// Where the location of a run of voxels stands between two dispatches.
struct RunState {
    uint next;      // Number of the next voxel in the run.
    uint hint;      // Cell of the last voxel found, or all ones.
    uint cursor;    // Candidates of the current leaf already tested.
    uint best;      // Best candidate so far, or all ones.
    uint in_box;    // Whether the best one's box holds the centre.
    float smallest; // Its smallest barycentric coordinate.
    uint inside;    // Voxels with their centre in a cell.
    uint waiting;   // Voxels whose boxes must be looked at and have not been listed.
};

// What has become of a slice.
struct SliceStatus {
    uint locating; // Runs of voxels whose centres need another round.
    uint touching; // Voxels whose boxes need another round; they are looked at once no centre does.
    uint refused;  // Not 0: boxes are flat (1) or more than twice as large as the mesh (2); all voxels are empty then.
    uint inside;   // Voxels with their centre in the mesh; counted once all centres are located.
    uint touched;  // Voxels that the mesh merely touches; counted once all boxes are looked at.
    uint empty;    // Voxels that it does not, and until then those that it may touch.
};

// The cells of a tree in the frame common to two meshes, the normalised coordinates of their joint grid; see src/reference/overlap.rs.
struct NodeFrame {
    vec4 corner;    // Lower corner of the tree's bounds.
    vec4 half_size; // Half the tree's bounds.
    vec4 flat_axis; // 1 where an axis is flat to the quantization, else 0.
    vec4 joint_lo;  // Lower corner of the joint grid in the units of the meshes.
    float scale;    // Scale of the joint grid.
    uint pad0;      // Unused.
    uint pad1;      // Unused.
    uint pad2;      // Unused.
};

// Counters of one direction of an overlap; 64 bits as two words, low first. Those that are zeroed between rounds lie 16 bytes behind the one that
// dispatches are sized by, since a descriptor of a word covers as much.
struct OverlapStatus {
    uint waiting;    // Primitives that need a search.
    uint by_vertex;  // Primitives with a vertex in the other mesh, or around one of its vertices.
    uint by_node;    // Primitives that touch a non-boundary node of the other tree.
    uint located;    // Vertices that had to be looked up in the list of a leaf.
    uint unfinished; // Primitives that need another dispatch.
    uint unfilled;   // Primitives whose pairs need another dispatch to be written; at least 1 as long as pairs are being counted.
    uint narrow[2];  // Tests of two tetrahedra by separating axes.
    uint pairs[2];   // Pairs that touch.
    uint empty;      // Not 0: one of the meshes has no valid tetrahedron, so nothing intersects.
    uint pad;        // Unused.
};

// Where the search of a primitive stands between two dispatches.
struct SearchState {
    uint code;  // Morton code of the leaf to go on with; all ones: done.
    uint entry; // Entries of that leaf already seen.
    uint phase; // 0: non-boundary nodes; 1: lists. Of pairs, 0: counted; 1: written.
    uint place; // Pairs found so far, or where the next one goes.
};

// Where a mesh and its tree lie, for the shaders of other programs: device addresses, low word first. See src/glsl.rs.
struct SceneAddresses {
    uvec2 grid;       // Grid with the level of the leaves.
    uvec2 masks;      // Child masks.
    uvec2 co;         // Child offsets.
    uvec2 po;         // Primitive offsets of the leaves.
    uvec2 p;          // Primitive ids.
    uvec2 flags;      // Boundary flags.
    uvec2 cells;      // Vertex indices.
    uvec2 vertices;   // Normalised coordinates.
    uvec2 neighbours; // Neighbour table.
    uvec2 field;      // One float per point, or anything where no field is asked for.
    uint lists;       // 1: leaves within the mesh have a seed instead of a list.
    uint has_field;   // Not 0: `field` is one.
};
