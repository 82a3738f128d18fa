// The buffers of a tree, six from `slot` on, as tree.glsl reads them.
#define TREE(slot)                          \
    GRID(slot, readonly)                    \
    BUFFER(slot + 1, readonly, uint, masks) \
    BUFFER(slot + 2, readonly, uint, co)    \
    BUFFER(slot + 3, readonly, uint, po)    \
    BUFFER(slot + 4, readonly, uint, p)     \
    BUFFER(slot + 5, readonly, uint, flags)
