// Point location in the baseline's binary tree. The including kernel declares nodes, ids, root, cells, vertices.
#include "shared/candidates.glsl"

const uint LBVH_LEAF = 0x80000000u;
const uint LBVH_STACK = 64u;     // a code has 30 bits and a place 29: the tree is no deeper
const uint LBVH_VISITS = 30000u; // loop limit
const float GROW = 4e-5;

bool box_holds(uint node, vec3 at) {
    vec3 lo = vec3(nodes.at[node].lo[0], nodes.at[node].lo[1], nodes.at[node].lo[2]);
    vec3 hi = vec3(nodes.at[node].hi[0], nodes.at[node].hi[1], nodes.at[node].hi[2]);
    vec3 grow = (hi - lo) * GROW;
    return all(lessThanEqual(lo - grow, at)) && all(lessThanEqual(at, hi + grow));
}

uint lbvh_owner(vec3 at, vec3 x, float tolerance) {
    uint stack[LBVH_STACK];
    uint top = 0u, reference = root.at[0];
    uint owner = NONE;
    Best best = no_best();
    for (uint visit = 0u; visit < LBVH_VISITS && reference != NONE; ++visit) {
        if ((reference & LBVH_LEAF) != 0u) {
            uint t = ids.at[reference & ~LBVH_LEAF];
            Tet tet = load_tet(cells.at[t]);
            Weights w = weights(tet, x);
            if (w.inside) {
                owner = min(owner, t);
            } else {
                float s = smallest(w);
                bool better = best.owner == NONE || (w.in_box && !best.in_box)
                    || (w.in_box == best.in_box && (s > best.smallest || (s == best.smallest && t < best.owner)));
                if (better && volume(tet) != 0.0) best = Best(t, false, w.in_box, s);
            }
        } else if (box_holds(reference, at)) {
            stack[top++] = nodes.at[reference].right;
            reference = nodes.at[reference].left;
            continue;
        }
        reference = top > 0u ? stack[--top] : NONE;
    }
    if (owner != NONE) return owner;
    return best.owner != NONE && best.smallest >= -tolerance ? best.owner : NONE;
}
