// Scans and sums over a workgroup, by subgroups of any size.
shared uint subgroup_totals[128];

// The sum of `v` over the subgroups before this one; `total` receives that over all. Called by the whole workgroup.
uint subgroups_exclusive_add(uint v, out uint total) {
    total = subgroupAdd(v);
    uint before = 0u;
    if (gl_NumSubgroups > 1u) {
        barrier();
        if (subgroupElect()) subgroup_totals[gl_SubgroupID] = total;
        barrier();
        total = 0u;
        for (uint s = 0u; s < gl_NumSubgroups; ++s) {
            if (s == gl_SubgroupID) before = total;
            total += subgroup_totals[s];
        }
    }
    return before;
}

// The sum of `v` over the invocations before this one; `total` receives that over all. Called by the whole workgroup.
uint workgroup_exclusive_add(uint v, out uint total) {
    uint before = subgroupExclusiveAdd(v);
    return before + subgroups_exclusive_add(v, total);
}

// The sum of `v` over the workgroup.
uint workgroup_add(uint v) {
    uint total;
    subgroups_exclusive_add(v, total);
    return total;
}
