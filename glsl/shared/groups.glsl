// The arguments of an indirect dispatch over `items` items, `each` per workgroup, folded into two dimensions as in
// kernel.glsl.
uvec3 groups_for(uint items, uint each) {
    uint g = items / each + uint(items % each != 0u);
    return g > 65535u ? uvec3(32768u, (g + 32767u) / 32768u, 1u) : uvec3(g, 1u, 1u);
}
