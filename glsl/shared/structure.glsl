// The structure that a kernel searches: the octree, or the baseline's binary tree if BINARY_TREE is defined. Its
// buffers follow the kernel's own.
#ifdef BINARY_TREE
#define STRUCTURE_BUFFERS 4
#define STRUCTURE(slot)                         \
    BUFFER16(slot, readonly, LbvhNode, nodes)   \
    BUFFER(slot + 1, readonly, uint, root)      \
    BUFFER(slot + 2, readonly, uint, ids)       \
    BUFFER(slot + 3, readonly, uint, boundary)
#else
#define STRUCTURE_BUFFERS 5
#define STRUCTURE(slot)                     \
    BUFFER(slot, readonly, uint, masks)     \
    BUFFER(slot + 1, readonly, uint, co)    \
    BUFFER(slot + 2, readonly, uint, po)    \
    BUFFER(slot + 3, readonly, uint, p)     \
    BUFFER(slot + 4, readonly, uint, flags)
#endif
