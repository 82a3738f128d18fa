// Arguments of indirect dispatches. The including kernel declares `groups`: x, y and z of one dispatch after the other.

// Workgroups for `items` items, `each` per workgroup, folded into two dimensions as in kernel.glsl.
void write_groups(uint slot, uint items, uint each) {
    uint g = items / each + uint(items % each != 0u);
    bool folded = g > 65535u;
    groups.at[3u * slot] = folded ? 32768u : g;
    groups.at[3u * slot + 1u] = folded ? (g + 32767u) / 32768u : 1u;
    groups.at[3u * slot + 2u] = 1u;
}
