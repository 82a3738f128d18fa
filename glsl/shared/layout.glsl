// The structs that host and device share, with those of scene.glsl. build.rs reflects both into src/layout.rs, comments
// included.
#include "shared/scene.glsl"

// What is known about a mesh on the device (SPEC 2.1, 2.3). Counters are zeroed before use.
struct MeshStatus {
    uint lo[3];     // Lower corner of the bounds as ordered keys, complemented, so that 0 means: no vertex yet.
    uint hi[3];     // Upper corner of the bounds as ordered keys.
    uint bad;       // Bad tetrahedra: index out of range, repeated vertex, or coordinate not finite or beyond 2^125.
    uint boundary;  // Boundary tetrahedra.
    uint zero_volume; // Tetrahedra of zero volume.
    uint negative;  // Tetrahedra of negative volume in the caller's order of vertices.
    uint crowded;   // Vertices with so many thin corners that more tetrahedra may meet there than a star can have.
    uint overflow;  // Not 0: the table of faces was full, which it can be beyond 429 million tetrahedra only.
    uint branched;  // Faces that more than two tetrahedra share, which are then not neighbours there.
};

// The result of a build (SPEC 2.4, 2.5).
struct BuildStatus {
    uint level;            // Level of the leaves, l.
    uint wanted_level;     // Level by alpha (Eq. 12), or as requested; `level` is smaller where a limit lowered it.
    uint candidates;       // Cells in the quantized boxes of all tetrahedra, which are the entries with `Aabb`.
    uint entries;          // Number of entries, n_m.
    uint nodes;            // Number of nodes, n_n.
    uint internal;         // Number of internal nodes, n_ni.
    uint leaves;           // Nodes on the last level.
    uint boundary_leaves;  // Leaves with the boundary flag.
    uint longest_leaf;     // Entries of the longest leaf.
    uint large_levels;     // Bit k: on level k, some tetrahedron has more candidates than a share holds.
    uint sum[2];           // Sum of the estimates of Eq. 11, low word first.
    uint total[22];        // Candidates of every level, low word first.
    uint levels[11];       // NO: element k is the number of nodes on levels 0 to k.
    uint overflow;         // Not 0: a capacity was exceeded (never a planned one), or the budget cannot hold a root.
};

// The view of a picture, without mesh, tree and field; see src/render.
struct ViewUniforms {
    vec4 origin;     // Origin of the ray of pixel (0, 0); p of a depth buffer, whose value d lies at direction·(p + d·q) / (r + d·s) from the origin.
    vec4 origin_x;   // What one pixel to the right adds to the origin; q of a depth buffer.
    vec4 origin_y;   // What one pixel down adds to the origin; r of a depth buffer.
    vec4 direction;        // Direction of the ray of pixel (0, 0), of any length; s of a depth buffer.
    vec4 direction_x;      // What one pixel to the right adds to the direction.
    vec4 direction_y;      // What one pixel down adds to the direction.
    vec4 to_light;   // Unit vector to the light; strength of the viewer's light as a part of its.
    vec4 strength;   // Strength of ambient, diffuse and specular light; opacity of one step at a rim.
    float step_size; // Distance between two samples.
    float inverse_step; // Reciprocal of `step_size`, rounded on the host.
    float value_lo;  // Value at place 0 of the table.
    float value_scale; // Places of the table per unit of value.
    float termination; // A ray ends once it is this opaque.
    uint isos;       // Number of iso-surfaces.
    uint clips;      // Number of clips.
    float cut_fade;  // Part of its light that a cut loses per step behind it.
    float iso[8];    // Values of the iso-surfaces, ascending.
    vec4 clip[4];    // Planes beyond which nothing is drawn: unit normal n, and d. Points p with n·p ≤ d are kept.
};

// What the device computes from a view.
struct DrawUniforms {
    vec4 slack;      // Boxes are enlarged by this, so that rounding loses no sample.
    vec4 slab_scale; // Reciprocals of the half sizes of the octree's leaves, see slab.glsl.
    uint size[2];    // Width and height in pixels.
    uint visible_at; // Word of the flags where the marks of visible nodes start, if there are any.
    uint row;        // Row of the view that is the first row of this picture.
    uint first_cell; // First cell of the finest grid whose samples are taken, 10 bits per axis, x lowest.
    uint last_cell;  // Last such cell. The box of the two cells contains a block of the mesh, or all of it.
    uint pad[2];     // Unused.
};

// State of the march along a ray between two dispatches.
struct RayState {
    uint next;      // Number of the next sample.
    uint end;       // One past the last sample.
    uint cursor;    // Not 0: how much of the leaf's list has been searched for the next sample; the search goes on.
    uint tet;       // Then the best candidate owner so far, else the tetrahedron of the last sample; or `NONE`.
    float smallest; // Smallest barycentric coordinate of the best candidate.
    uint last;      // `NONE` if the last sample shows nothing. Otherwise, for iso-surfaces, bits of the value where the ray leaves its tetrahedron.
    float last_at;  // Distance of that place from the ray's origin in steps; of a ray that has become opaque, of the place where it did.
    uint check;     // Sample from which visibility is tested; the two top bits are flags of the best candidate.
    uint item;      // Which ray it is: its place in blocks of 8×8 pixels, the rays of a block along a Z curve.
};

// Counters of a picture. Counters of 64 bits are two words, the low one first.
struct RenderStatus {
    uint met;        // Rays that march: those that may meet the mesh, and others beside them. First member, since bound by itself.
    uint samples[2]; // Samples taken.
    uint found[2];   // Samples in the mesh.
    uint skipped[2]; // Samples not taken, in nodes without anything visible.
    uint unfinished; // Rays that need another round.
};

// A node of the baseline's binary tree (Apetrei 2014). Internal node i splits the sorted tetrahedra after place i. In a
// reference to a child, bit 31 says that the lower bits are a place among the sorted tetrahedra, not an internal node,
// and bit 30 that a boundary tetrahedron is below.
struct LbvhNode {
    float lo[3];   // Lower corner of the box in normalised coordinates.
    uint left;     // Reference to the left child.
    float hi[3];   // Upper corner of the box.
    uint right;    // Reference to the right child.
};

// A stack of layers of voxels over a mesh; see src/slicing.
struct SliceUniforms {
    uint listed; // Voxels of the band whose centre lies in no tetrahedron. First member, since bound by itself.
    uint pad0;   // Unused.
    uint pad1;   // Unused.
    uint pad2;   // Unused.
    vec4 origin; // Centre of voxel (0, 0) of layer 0.
    vec4 next_voxel; // From one voxel of a row to the next.
    vec4 next_row;   // From one row to the next.
    vec4 next_layer; // From one layer to the next.
    vec4 half0;  // Half axis of a voxel's box along the row, in normalised coordinates.
    vec4 half1;  // Half axis of the box from row to row.
    vec4 half2;  // Half axis of the box from layer to layer.
    vec4 reach;  // Half extent of a voxel's box along the axes in the units of the mesh, and a little more.
    uint width;  // Voxels per row.
    uint height; // Rows of a layer.
    uint layer;  // Layer of the first row of the band, the rows that are sliced now.
    uint first;  // Number of that row in its layer.
    uint rows;   // Rows of the band.
    uint refused; // 1: boxes are flat; 2: boxes are longer along an axis than 4 / scale of the grid; else 0.
    uint first_cell; // First cell of the finest grid that is searched, 10 bits per axis, x lowest.
    uint last_cell;  // Last such cell. The box of the two cells contains a block of the mesh, or all of it.
};

// State of the search for the tetrahedron closest to a voxel between two dispatches.
struct TouchState {
    uint code;    // Morton code of the leaf to resume at; in a binary tree, the place of a tetrahedron.
    uint entry;   // Entries of that leaf already tested.
    uint owner;   // Closest tetrahedron so far, or `NONE`.
    float square; // Squared distance of that tetrahedron.
    uint voxel;   // Number of the voxel in the band.
};

// State of the search for the place of the surface that is closest to a point.
struct NearState {
    uint code;    // Morton code of the leaf to resume at, or `NONE`: the search has ended.
    uint entry;   // Entries of that leaf already tested.
    uint owner;   // Closest tetrahedron at the surface so far, or `NONE`.
    float square; // Its squared distance, scaled by (scale·2^19)² of the grid; infinite if the search ended without one.
};

// State of the location of a run of voxels between two dispatches.
struct RunState {
    uint next;      // Number of the next voxel in the run.
    uint hint;      // Tetrahedron of the last voxel found, or `NONE`.
    uint cursor;    // Entries of the current leaf already tested.
    uint best;      // Best candidate owner so far, or `NONE`.
    uint in_box;    // Flags of the best candidate: its box contains the centre (bit 0); it does itself (bit 1).
    float smallest; // Smallest barycentric coordinate of the best candidate.
    uint inside;    // Voxels with their centre in a tetrahedron.
    uint waiting;   // Voxels whose boxes must be tested and have not been listed yet.
};

// Progress and result of slicing.
struct SliceStatus {
    uint locating; // Runs of voxels whose centres need another round.
    uint touching; // Voxels whose boxes need another round. Boxes are tested once all centres are located.
    uint refused;  // Not 0: boxes are flat (1) or too large, as in `SliceUniforms` (2), and all voxels are empty.
    uint inside;   // Voxels with their centre in the mesh. Counted once all centres are located.
    uint touched;  // Voxels that the mesh only touches. Counted once all boxes are tested.
    uint empty;    // Voxels that it does not touch and, until all boxes are tested, those that it may touch.
};

// The cells of a tree in the frame common to two meshes, the normalised coordinates of their joint grid; see
// src/reference/overlap.rs.
struct NodeFrame {
    vec4 corner;    // Lower corner of the tree's bounds.
    vec4 half_size; // Half the size of the tree's bounds.
    vec4 flat_axis; // 1 where an axis is flat to the quantization, else 0.
    vec4 joint_lo;  // Lower corner of the joint grid in the units of the meshes.
    float scale;    // Scale of the joint grid.
    uint pad0;      // Unused.
    uint pad1;      // Unused.
    uint pad2;      // Unused.
};

// Counters of one direction of an overlap. Counters of 64 bits are two words, the low one first. Those that are zeroed
// between rounds lie 16 bytes after `waiting`, by which dispatches are sized, since the descriptor of one word covers
// 16 bytes.
struct OverlapStatus {
    uint waiting;    // Tetrahedra that need a search.
    uint by_vertex;  // Tetrahedra with a vertex in the other mesh, or that contain one of its vertices.
    uint by_node;    // Tetrahedra that touch a non-boundary node of the other tree.
    uint located;    // Vertices that had to be looked up in the list of a leaf.
    uint unfinished; // Tetrahedra that need another dispatch.
    uint unfilled;   // Tetrahedra whose pairs need another dispatch to be written; not 0 while pairs are counted.
    uint narrow[2];  // Tests of two tetrahedra by separating axes.
    uint pairs[2];   // Pairs that touch.
    uint empty;      // Not 0: nothing intersects, since a mesh has no valid tetrahedron, or a tree did not fit its capacity.
    uint pad;        // Unused.
};

// State of the search of a tetrahedron between two dispatches.
struct SearchState {
    uint code;  // Morton code of the leaf to resume at; `NONE`: done.
    uint entry; // Entries of that leaf already tested.
    uint phase; // 0: non-boundary nodes; 1: lists. For pairs, 0: counting; 1: writing.
    uint place; // Pairs found so far, or where the next one goes.
};
