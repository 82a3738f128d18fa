// olbvh for the shaders of other programs, in any stage: point location (SPEC 3.1), walks (SPEC 2.6), all owners of a
// point, value and gradient of a field, and traversal with the host's own predicates (the paper's Alg. 3).
//
//     #version 460
//     #include "olbvh.glsl"                     first of all, since it enables extensions
//     layout(push_constant) uniform Push { uvec2 tree; };
//     ...
//     olbvh_open(tree);                         once per invocation
//     vec4 weights;
//     uint owner = olbvh_locate(place, 1e-5, weights);
//     if (owner != OLBVH_NONE) value = olbvh_value(owner, weights);
//
// `tree` is the address of a SceneAddresses that the host has filled (olbvh::glsl::SceneBuffers). On devices without
// buffer addresses, define OLBVH_DESCRIPTORS before the inclusion: the arrays are then storage buffers of set OLBVH_SET
// (0 unless defined) from binding OLBVH_BINDING (0 unless defined) on, in the order of SceneBuffers::list, and the
// argument of olbvh_open is ignored.
//
// The crate exports this file with its includes in place and with the prefix olbvh_ before all names. src/glsl.rs has
// the guide.
#ifndef OLBVH_GLSL
#define OLBVH_GLSL
#ifndef OLBVH_SET
#define OLBVH_SET 0
#endif
#ifndef OLBVH_BINDING
#define OLBVH_BINDING 0
#endif
#extension GL_EXT_control_flow_attributes : require
#ifdef OLBVH_DESCRIPTORS
#define OLBVH_BUFFER(slot, alignment, T, name)                                                                                  \
    layout(set = OLBVH_SET, binding = OLBVH_BINDING + slot, std430) readonly buffer name##Block { T at[]; } name;
#else
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#define OLBVH_BUFFER(slot, alignment, T, name)                                                                                  \
    layout(buffer_reference, std430, buffer_reference_align = alignment) readonly buffer name##Block { T at[]; };               \
    name##Block name;
#endif
#define OLBVH_NONE 0xffffffffu

const uint NONE = OLBVH_NONE;
// Records of four words are read as they are. Kernels of the library can also read them as two 64-bit words.
uvec4 words(uvec4 record) { return record; }
vec4 floats(vec4 record) { return record; }
#include "shared/scene.glsl"

OLBVH_BUFFER(0, 8, SceneAddresses, scene)
OLBVH_BUFFER(1, 16, Grid, grid)
OLBVH_BUFFER(2, 4, uint, masks)
OLBVH_BUFFER(3, 4, uint, co)
OLBVH_BUFFER(4, 4, uint, po)
OLBVH_BUFFER(5, 4, uint, p)
OLBVH_BUFFER(6, 4, uint, flags)
OLBVH_BUFFER(7, 16, uvec4, cells)
OLBVH_BUFFER(8, 16, vec4, vertices)
OLBVH_BUFFER(9, 16, uvec4, neighbours)
OLBVH_BUFFER(10, 4, float, field)
uint LISTS;

vec4 knot(uint i) { return grid.at[0].knots[i]; }
vec4 rate(uint i) { return grid.at[0].rates[i]; }
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/node.glsl"
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"
#include "shared/owner_walk.glsl"

// Selects the tree that the functions below use.
void olbvh_open(uvec2 tree) {
#ifndef OLBVH_DESCRIPTORS
    scene = sceneBlock(tree);
    SceneAddresses a = scene.at[0];
    grid = gridBlock(a.grid);
    masks = masksBlock(a.masks);
    co = coBlock(a.co);
    po = poBlock(a.po);
    p = pBlock(a.p);
    flags = flagsBlock(a.flags);
    cells = cellsBlock(a.cells);
    vertices = verticesBlock(a.vertices);
    neighbours = neighboursBlock(a.neighbours);
    field = fieldBlock(a.field);
#endif
    LISTS = scene.at[0].lists;
}

// The tetrahedron that owns a point (in the units of the mesh), or OLBVH_NONE, and the point's barycentric coordinates
// in the order of the tetrahedron's vertices. A point outside of the mesh is found if its smallest coordinate in the
// nearest tetrahedron is at least -tolerance.
uint olbvh_locate(vec3 place, float tolerance, out vec4 weights_of_owner) {
    weights_of_owner = vec4(0.0);
    Grid g = grid.at[0];
    vec3 x = normalise(g, place);
    uint leaf = leaf_to_search(g, place, x, tolerance);
    if (leaf == NONE) return NONE;
    uvec2 range = entry_range(leaf);
    Best best = walked(g, leaf, range, place, x);
    if (!best.inside && !walks_in(leaf, range)) search(best, range.x, range.y, sought_at(g, place, x, tolerance));
    uint owner = decide(best, leaf, tolerance);
    if (owner == NONE) return NONE;
    weights_of_owner = barycentric(load_tet(words(cells.at[owner])), x);
    return owner;
}

// Walks straight from a point `start` in the tetrahedron `from` to the point `end`, as a particle moves. Returns the
// owner of the end, and its barycentric coordinates. If the way leads out of the mesh, it returns OLBVH_NONE, and `left`
// is the last tetrahedron and the number of the vertex opposite to the face through which it leaves; otherwise `left` is
// OLBVH_NONE twice. So are both for points farther outside the bounds of the mesh than half their largest extent, and
// where `from` is OLBVH_NONE.
uint olbvh_walk(uint from, vec3 start, vec3 end, out vec4 weights_of_owner, out uvec2 left) {
    weights_of_owner = vec4(0.0);
    left = uvec2(NONE);
    Grid g = grid.at[0];
    if (from == NONE || !near_bounds(g, start) || !near_bounds(g, end)) return NONE;
    vec3 x = normalise(g, end);
    uint face;
    uint t = walk_leg(from, normalise(g, start), x, face);
    if (face != NONE) {
        left = uvec2(t, face);
        return NONE;
    }
    Best best = no_best();
    arrive(t, x, best);
    // Rounding may lead a walk astray round an edge, and a walk of many steps ends early.
    if (!best.inside) return olbvh_locate(end, 0.0, weights_of_owner);
    weights_of_owner = barycentric(load_tet(words(cells.at[best.owner])), x);
    return best.owner;
}

// The number of tetrahedra that contain a point; `owners` receives the first OLBVH_OWNERS of them, in no particular
// order.
#ifndef OLBVH_OWNERS
#define OLBVH_OWNERS 32
#endif
uint olbvh_owners(vec3 place, out uint owners[OLBVH_OWNERS]) {
    Grid g = grid.at[0];
    vec3 x = normalise(g, place);
    uint leaf = leaf_to_search(g, place, x, 0.0);
    if (leaf == NONE) return 0u;
    uvec2 range = entry_range(leaf);
    bool by_walk = walks_in(leaf, range);
    if (by_walk) {
        Best first = walked(g, leaf, range, place, x), unused = no_best();
        if (first.owner == NONE) return 0u;
        arrive(first.owner, x, unused);
        range = uvec2(0u, star_size);
    }
    Sought sought = sought_at(g, place, x, 0.0);
    uint n = 0u;
    for (uint begin = range.x; begin < range.y; begin += 32u) {
        uint count = min(32u, range.y - begin);
        for (uint near = by_walk ? NONE >> (32u - count) : near_among(begin, range.y, sought); near != 0u; near &= near - 1u) {
            uint i = begin + findLSB(near), t = by_walk ? star[i] : listed_tet(i);
            if (!weights(load_tet(words(cells.at[t])), x).inside) continue;
            if (n < OLBVH_OWNERS) owners[n] = t;
            ++n;
        }
    }
    return n;
}

float no_value() { return uintBitsToFloat(0x7fc00000u); } // NaN

// The value of the field, which has one value per point of the mesh, in a tetrahedron; NaN without a field.
float olbvh_value(uint owner, vec4 weights_of_owner) {
    if (scene.at[0].has_field == 0u) return no_value();
    uvec4 v = words(cells.at[owner]);
    return weighed(weights_of_owner, vec4(field.at[v.x], field.at[v.y], field.at[v.z], field.at[v.w]));
}

// The numbers of a tetrahedron's vertices, for fields in buffers of the host, of any number of components:
// olbvh_weighed(weights, values at these vertices) is what olbvh_value computes.
uvec4 olbvh_corners(uint owner) { return words(cells.at[owner]); }

// The gradient of the field in a tetrahedron, per unit of length of the mesh; 0 in a flat one, NaN without a field.
vec3 olbvh_gradient(uint owner) {
    if (scene.at[0].has_field == 0u) return vec3(no_value());
    uvec4 v = words(cells.at[owner]);
    vec3 a = vertex(v.x), e1 = vertex(v.y) - a, e2 = vertex(v.z) - a, e3 = vertex(v.w) - a;
    // Normalised coordinates lie in [0, 2^41).
    const float UNIT = 1.0 / 1099511627776.0;
    e1 *= UNIT;
    e2 *= UNIT;
    e3 *= UNIT;
    float six_volumes = dot(e1, cross(e2, e3)), f = field.at[v.x];
    if (six_volumes == 0.0) return vec3(0.0);
    vec3 sum = (field.at[v.y] - f) * cross(e2, e3) + (field.at[v.z] - f) * cross(e3, e1) + (field.at[v.w] - f) * cross(e1, e2);
    return sum / six_volumes * grid.at[0].scale;
}

// Traversal with the host's predicates: define OLBVH_TRAVERSE before the inclusion, and after it
//     bool olbvh_visit_node(olbvh_Node node);  descend? Also asked for leaves; may become stricter during a traversal
//     bool olbvh_visit_leaf(olbvh_Node node);  called for an accepted leaf; returns true to end the traversal
// olbvh_node_box gives the box of a node, olbvh_entries the entries [x, y) of a leaf, and olbvh_primitive(i) the
// tetrahedron of entry i.
#ifdef OLBVH_TRAVERSE
#ifndef OLBVH_STACK
#define OLBVH_STACK 8
#endif
const uint STACK = OLBVH_STACK;
bool visit_node(Node node);
bool visit_leaf(Node node);
#include "shared/traverse.glsl"
#include "shared/boxes.glsl"

// Traverses the tree. Returns false if it has too many nodes to visit in one call (24,000 internal nodes).
bool olbvh_traverse() { return traverse(grid.at[0].level); }

void olbvh_node_box(Node node, out vec3 lo, out vec3 hi) { cell_box(grid.at[0], node.level, node.code, lo, hi); }

bool olbvh_is_boundary(Node node) { return is_boundary_node(node.index); }

uvec2 olbvh_entries(Node node) { return entry_range(node.index); }

uint olbvh_primitive(uint entry) { return listed_tet(entry); }
#endif
#endif
