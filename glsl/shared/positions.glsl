// Vertices as the caller stores them. The including kernel declares positions.
vec3 position(uint v, uint stride) { return vec3(positions.at[v * stride], positions.at[v * stride + 1u], positions.at[v * stride + 2u]); }
