// Points that are asked about, as the caller stores them. The including kernel declares points.
vec3 point(uint i, uint stride) { return vec3(points.at[i * stride], points.at[i * stride + 1u], points.at[i * stride + 2u]); }
