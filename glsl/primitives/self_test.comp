#version 460
// The start-up self-test, whose answers are known: a long loop, a ballot, a subgroup scan, and sums, products and floors
// of floats. 64 invocations report.
#include "shared/kernel.glsl"
ARGUMENTS(2)
    uint iterations;
END_ARGUMENTS
BUFFER(0, writeonly, uint, lanes)    // 64 loop counts, 64 ballot counts, 64 sums; 64 results of each of five computations
BUFFER(1, readonly, float, operands) // three for each invocation

void main() {
    uint i = local_index();
    uint n = 0u;
    // The limit is an argument, so that no compiler can evaluate the loop.
    for (uint k = 0u; k < iterations; ++k) {
        n += 1u + (n >> 31u);
        if (n == NONE) break;
    }
    uint odd = subgroupBallotExclusiveBitCount(subgroupBallot((gl_SubgroupInvocationID & 1u) == 0u));
    uint sum = subgroupInclusiveAdd(i);
    if (i >= 64u) return;
    lanes.at[i] = n;
    lanes.at[64u + i] = odd;
    lanes.at[128u + i] = sum;
    float a = operands.at[3u * i], b = operands.at[3u * i + 1u], c = operands.at[3u * i + 2u];
    precise float added = a + b, product = a * b;
    precise float rest = a * b - c, regained = (a + b) - a; // which contraction, and reordering, would change
    lanes.at[192u + i] = floatBitsToUint(added);
    lanes.at[256u + i] = floatBitsToUint(product);
    lanes.at[320u + i] = floatBitsToUint(rest);
    lanes.at[384u + i] = floatBitsToUint(regained);
    lanes.at[448u + i] = floatBitsToUint(floor(a * 64.0));
}
