// A picture as its kernels read it: the host's view, what the device computes from it, the transfer function, and the
// top of the octree.

const uint TABLE = 1024u; // Entries of the transfer function.
const uint TOP_LEVEL = 4u; // Level of the octree from which samples descend, unless leaves are higher.
const uint MISSING = 0x80000000u;

struct Frame {
    ViewUniforms view;
    DrawUniforms plan;
    FLOATS table[TABLE]; // sRGB colour, and opacity of one step
    // The octree's node of each cell of that level, or, if there is none, MISSING and the highest level without one.
    uint top[1u << 3u * TOP_LEVEL];
};
