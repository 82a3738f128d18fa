// Arrays of four-word records that are read whole: cells, vertices. Drivers for processors fetch every component
// separately, so that two 64-bit components halve the number of fetches (OLBVH_WIDE).
#ifdef OLBVH_WIDE
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#define FLOATS u64vec2
#define PAIR uint64_t
#define RECORDS(slot, T, name) BUFFER16(slot, readonly, u64vec2, name)
uvec4 words(u64vec2 record) { return uvec4(unpack32(record.x), unpack32(record.y)); }
vec4 floats(u64vec2 record) { return uintBitsToFloat(words(record)); }
uvec2 words(uint64_t pair) { return unpack32(pair); }
uint64_t pair(uint a, uint b) { return pack64(uvec2(a, b)); }
u64vec2 record(vec4 floats) { return u64vec2(pack64(floatBitsToUint(floats.xy)), pack64(floatBitsToUint(floats.zw))); }
#else
#define FLOATS vec4
#define PAIR uvec2
#define RECORDS(slot, T, name) BUFFER16(slot, readonly, T, name)
uvec4 words(uvec4 record) { return record; }
uvec2 words(uvec2 pair) { return pair; }
uvec2 pair(uint a, uint b) { return uvec2(a, b); }
vec4 floats(vec4 record) { return record; }
vec4 record(vec4 floats) { return floats; }
#endif
