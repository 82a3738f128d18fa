#version 460
// The start-up self-test, whose answers are known: a long loop, a ballot, a subgroup scan. 64 invocations report.
#include "shared/kernel.glsl"
ARGUMENTS(1)
    uint iterations;
END_ARGUMENTS
BUFFER(0, READ_WRITE, uint, lanes) // 64 loop counts, 64 ballot counts, 64 sums

void main() {
    uint i = local_index();
    uint n = 0u;
    // The limit is an argument, so that no compiler can evaluate the loop.
    if (i < 64u) lanes.at[i] = 0u;
    for (uint k = 0u; k < iterations; ++k) {
        n += 1u + (n >> 31u);
        if (n == NONE) break;
    }
    uint odd = subgroupBallotExclusiveBitCount(subgroupBallot((gl_SubgroupInvocationID & 1u) == 0u));
    uint sum = subgroupInclusiveAdd(i);
    if (i < 64u) {
        lanes.at[i] = n;
        lanes.at[64u + i] = odd;
        lanes.at[128u + i] = sum;
    }
}
