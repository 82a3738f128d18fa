#version 460
// Ray tracing baseline: rays are traced by ray queries in a compute shader.
#extension GL_EXT_ray_query : require
#include "shared/kernel.glsl"
#include "baseline/locate_by_ray.glsl"

uvec2 first_face(vec3 origin, float most) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, accelerationStructureEXT(scene), gl_RayFlagsOpaqueEXT, 0xffu, origin, 0.0, WAY, most);
    rayQueryProceedEXT(query); // opaque faces: once is enough
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionTriangleEXT) return uvec2(NONE, 0u);
    return uvec2(rayQueryGetIntersectionPrimitiveIndexEXT(query, true), uint(rayQueryGetIntersectionFrontFaceEXT(query, true)));
}

void main() { locate(item_index()); }
