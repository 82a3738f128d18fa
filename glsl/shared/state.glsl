// What kernels leave for one another, also from one dispatch to the next. To a host it is room in scratch memory.

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

// State of the search of a tetrahedron between two dispatches.
struct SearchState {
    uint code;  // Morton code of the leaf to resume at; `NONE`: done.
    uint entry; // Entries of that leaf already tested.
    uint phase; // 0: non-boundary nodes; 1: lists. For pairs, 0: counting; 1: writing.
    uint place; // Pairs found so far, or where the next one goes.
};
