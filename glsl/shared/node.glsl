// A node as predicates see it.
struct Node {
    uint index;
    uint level;
    uint code; // Morton code of its cell at that level
};
