// The structs of a host's buffers, with those of scene.glsl. build.rs reflects both and state.glsl into src/layout.rs,
// comments included.
#include "shared/scene.glsl"
#include "shared/state.glsl"

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
    uint parted;    // Not 0: since neighbours were searched for, some were parted, as tetrahedra became bad for a while.
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

// State of the search for the place of the surface that is closest to a point.
struct NearState {
    uint code;    // Morton code of the leaf to resume at, or `NONE`: the search has ended.
    uint entry;   // Entries of that leaf already tested.
    uint owner;   // Closest tetrahedron at the surface so far, or `NONE`.
    float square; // Its squared distance, scaled by (scale·2^19)² of the grid; infinite if the search ended without one.
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
