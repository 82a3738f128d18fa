/* Finds things inside tetrahedral meshes on any GPU; see README.md.
 * Generated from src/capi by cbindgen; scripts/c_api --write writes it anew. */

#ifndef OLBVH_H
#define OLBVH_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

/*
 How a call ended.
 */
typedef enum olbvh_status {
  /*
   Done.
   */
  OLBVH_STATUS_OK = 0,
  /*
   An argument makes no sense.
   */
  OLBVH_STATUS_INVALID = 1,
  /*
   No Vulkan, or no device that qualifies.
   */
  OLBVH_STATUS_DEVICE = 2,
  /*
   The device's memory does not suffice.
   */
  OLBVH_STATUS_MEMORY = 3,
  /*
   The mesh is larger than 32-bit offsets reach.
   */
  OLBVH_STATUS_TOO_LARGE = 4,
  /*
   A Vulkan call failed.
   */
  OLBVH_STATUS_VULKAN = 5,
  /*
   Anything else; please report it.
   */
  OLBVH_STATUS_INTERNAL = 6,
} olbvh_status;

/*
 A device.
 */
typedef struct olbvh_gpu olbvh_gpu;

/*
 A mesh in the device's memory.
 */
typedef struct olbvh_mesh olbvh_mesh;

/*
 Commands being recorded, and the descriptor sets they use: one per frame in flight.
 */
typedef struct olbvh_recording olbvh_recording;

/*
 A mesh and its tree in memory of the host's.
 */
typedef struct olbvh_scene olbvh_scene;

/*
 A tree over a mesh.
 */
typedef struct olbvh_tree olbvh_tree;

/*
 How to build a tree; `olbvh_default_build_options` fills it.
 */
typedef struct olbvh_build_options {
  /*
   The paper's alpha, 0 to 10: how many levels coarser than the cells' size the leaves are.
   */
  float alpha;
  /*
   0: cells of the bounding box. 1: of those, the cells that no face plane separates. 2: exactly the cells touched.
   */
  uint32_t assign;
  /*
   0: all primitives are listed (the paper). 1: where the surface is, seeds and walks elsewhere.
   */
  uint32_t lists;
  /*
   Most entries the tree may have; it gets coarser until it fits. 0: the usual capacity, 64 per tetrahedron and at least 2^20.
   */
  uint32_t capacity;
  /*
   Most bytes the arrays of the tree may have together; it gets coarser until it fits. 0: no limit.
   */
  uint64_t budget;
} olbvh_build_options;

/*
 What was built.
 */
typedef struct olbvh_tree_info_data {
  /*
   Level of the leaves.
   */
  uint32_t level;
  /*
   Primitive ids in the leaves.
   */
  uint32_t entries;
  /*
   Nodes.
   */
  uint32_t nodes;
  /*
   Leaves.
   */
  uint32_t leaves;
  /*
   Lower corner of the mesh.
   */
  float lo[3];
  /*
   Upper corner of the mesh.
   */
  float hi[3];
  /*
   Tetrahedra left out: a vertex that does not exist, occurs twice or is not finite.
   */
  uint32_t bad_cells;
  /*
   Milliseconds of device time.
   */
  double build_ms;
  /*
   Device address for `olbvh_open` of olbvh.glsl; 0 where the device has no buffer addresses.
   */
  uint64_t address;
} olbvh_tree_info_data;

/*
 A Vulkan device of the host's, to be used and never destroyed by olbvh. Handles are cast to `uint64_t`.
 */
typedef struct olbvh_host_device {
  /*
   `vkGetInstanceProcAddr`.
   */
  const void *get_instance_proc_addr;
  /*
   `VkInstance`, of Vulkan 1.2 or later.
   */
  uint64_t instance;
  /*
   `VkPhysicalDevice`.
   */
  uint64_t physical_device;
  /*
   `VkDevice`.
   */
  uint64_t device;
  /*
   `VkQueue` of that family, which nobody else submits to while a function of olbvh runs.
   */
  uint64_t queue;
  /*
   Queue family with compute.
   */
  uint32_t queue_family;
  /*
   Not 0: the feature `bufferDeviceAddress` is enabled.
   */
  uint32_t buffer_addresses;
  /*
   Not 0: `VK_EXT_subgroup_size_control` is enabled with `subgroupSizeControl` and `computeFullSubgroups`.
   */
  uint32_t subgroup_size_control;
  /*
   Not 0: the instance extension `VK_EXT_debug_utils` is enabled.
   */
  uint32_t debug_utils;
} olbvh_host_device;

/*
 What is known of a mesh and its tree before there is memory for them.
 */
typedef struct olbvh_plan {
  /*
   Points.
   */
  uint32_t points;
  /*
   32-bit floats from one point to the next, at least 3.
   */
  uint32_t stride;
  /*
   Tetrahedra.
   */
  uint32_t tets;
  /*
   Deepest level that the leaves may have, up to 10.
   */
  uint32_t level;
  /*
   At least the entries of the longest leaf, 0: any number. Location takes a dispatch for every 16,384 of them.
   */
  uint32_t longest_leaf;
  /*
   How to build. Without a capacity there is room for 24 entries per tetrahedron, or for what the budget allows.
   */
  struct olbvh_build_options build;
} olbvh_plan;

/*
 What memory a plan wants.
 */
typedef struct olbvh_plan_sizes {
  /*
   Bytes of mesh and tree, kept as long as the tree is asked.
   */
  uint64_t memory;
  /*
   Bytes in use while building only; frames in flight on one queue can share them.
   */
  uint64_t scratch;
  /*
   Offsets of parts are multiples of this.
   */
  uint64_t alignment;
  /*
   `VkBufferUsageFlags` of every buffer; with buffer addresses `VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT` as well.
   */
  uint32_t usage;
} olbvh_plan_sizes;

/*
 A part of a buffer of the host's.
 */
typedef struct olbvh_buffer {
  /*
   `VkBuffer`.
   */
  uint64_t buffer;
  /*
   Bytes from its start.
   */
  uint64_t offset;
  /*
   Bytes.
   */
  uint64_t size;
  /*
   Device address of the first byte of the part; 0 where buffer addresses are not enabled.
   */
  uint64_t address;
} olbvh_buffer;

/*
 Where the arrays of a scene are: what olbvh.glsl gets.
 */
typedef struct olbvh_scene_arrays_data {
  /*
   The content of the buffer whose address `olbvh_open` gets. By descriptors that buffer is the first of the bindings.
   */
  uint32_t addresses[22];
  /*
   The buffers of the other bindings, in order.
   */
  struct olbvh_buffer bindings[10];
  /*
   What was built, in words: level of the leaves, level that was asked for, candidates, entries, nodes, internal nodes, leaves, …
   */
  struct olbvh_buffer status;
} olbvh_scene_arrays_data;

/*
 A stage that was timed.
 */
typedef struct olbvh_stage {
  /*
   Such as "build.levels".
   */
  char name[64];
  /*
   Query with the time of its begin.
   */
  uint32_t begin;
  /*
   Query with the time of its end.
   */
  uint32_t end;
} olbvh_stage;

/*
 Points to locate, and where the answers go.
 */
typedef struct olbvh_location {
  /*
   32-bit floats, three of each point.
   */
  struct olbvh_buffer points;
  /*
   Floats from one point to the next, at least 3.
   */
  uint32_t stride;
  /*
   Points.
   */
  uint32_t count;
  /*
   As `olbvh_locate` takes it.
   */
  float tolerance;
  /*
   A word per point: its owner, or 0xffffffff.
   */
  struct olbvh_buffer owners;
  /*
   Four floats per point, in the order of the cell's vertices; zeroes without an owner.
   */
  struct olbvh_buffer barycentrics;
} olbvh_location;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 The text of the last error of this thread; valid until its next call.
 */
const char *olbvh_last_error(void);

/*
 Version of the library, such as "0.1.0".
 */
const char *olbvh_version(void);

/*
 Opens a device: part of its name, or its number; null: the best that qualifies.
 */
enum olbvh_status olbvh_gpu_open(const char *device, struct olbvh_gpu **out);

/*
 Lets a device go; null is allowed.
 */
void olbvh_gpu_free(struct olbvh_gpu *gpu);

/*
 Brings a mesh to the device: three floats per point, four indices per tetrahedron. Bad cells are left out and counted.
 */
enum olbvh_status olbvh_mesh_upload(const struct olbvh_gpu *gpu,
                                    const float *points,
                                    size_t point_count,
                                    const uint32_t *tets,
                                    size_t tet_count,
                                    struct olbvh_mesh **out);

/*
 Lets a mesh go; null is allowed.
 */
void olbvh_mesh_free(struct olbvh_mesh *mesh);

/*
 What `olbvh_tree_build` takes where it is given no options.
 */
struct olbvh_build_options olbvh_default_build_options(void);

/*
 Builds the tree over a mesh. `options` may be null.
 */
enum olbvh_status olbvh_tree_build(const struct olbvh_mesh *mesh,
                                   const struct olbvh_build_options *options,
                                   struct olbvh_tree **out);

/*
 Lets a tree go; null is allowed.
 */
void olbvh_tree_free(struct olbvh_tree *tree);

/*
 Tells what a tree is like.
 */
enum olbvh_status olbvh_tree_info(const struct olbvh_tree *tree, struct olbvh_tree_info_data *out);

/*
 Finds the owner of each of `count` points (three floats each): a tetrahedron, or 0xffffffff outside of the mesh. `barycentrics`, four floats per
 point in the order of the cell's vertices, may be null. A point outside is taken in if its smallest coordinate in the nearest cell is at least
 `-tolerance`; below 0 means the default, 1e-5.
 */
enum olbvh_status olbvh_locate(const struct olbvh_tree *tree,
                               const float *points,
                               size_t count,
                               float tolerance,
                               uint32_t *owners,
                               float *barycentrics);

/*
 Works on a device of the host's, which outlives everything made from the handle.
 */
enum olbvh_status olbvh_gpu_from_host(const struct olbvh_host_device *host, struct olbvh_gpu **out);

/*
 Tells what memory a plan wants.
 */
enum olbvh_status olbvh_plan_measure(const struct olbvh_gpu *gpu,
                                     const struct olbvh_plan *plan,
                                     struct olbvh_plan_sizes *out);

/*
 A scene of that plan: `positions` and `cells` (four indices per tetrahedron) are read whenever it is built, `memory` and `scratch` are of the sizes
 measured. The host keeps the buffers as long as it records with the scene.
 */
enum olbvh_status olbvh_scene_place(const struct olbvh_gpu *gpu,
                                    const struct olbvh_plan *plan,
                                    struct olbvh_buffer positions,
                                    struct olbvh_buffer cells,
                                    struct olbvh_buffer memory,
                                    struct olbvh_buffer scratch,
                                    struct olbvh_scene **out);

/*
 Lets a scene go, but not its buffers; null is allowed.
 */
void olbvh_scene_free(struct olbvh_scene *scene);

/*
 Tells where the arrays of a scene are. `field`, a float per point, may be null.
 */
enum olbvh_status olbvh_scene_arrays(const struct olbvh_scene *scene,
                                     const struct olbvh_buffer *field,
                                     struct olbvh_scene_arrays_data *out);

/*
 Makes what commands are recorded with: one per frame in flight, used by one thread at a time.
 */
enum olbvh_status olbvh_recording_new(const struct olbvh_gpu *gpu, struct olbvh_recording **out);

/*
 Lets a recording go, when its commands have been executed; null is allowed.
 */
void olbvh_recording_free(struct olbvh_recording *recording);

/*
 Begins anew. `commands` is a `VkCommandBuffer` in the recording state, outside of a render pass; what was recorded before has been executed. 0
 rehearses: commands compile what they need, and the end makes room for the descriptor sets they would take, so that recording the same later makes
 nothing. `queries` is a reset `VkQueryPool` for timestamps of that many queries, or 0; stages are timed as long as there are queries left.
 The recording binds a compute pipeline, push constants, and set 0 where the device has no buffer addresses.
 */
enum olbvh_status olbvh_recording_begin(struct olbvh_recording *recording,
                                        uint64_t commands,
                                        uint64_t queries,
                                        uint32_t query_count);

/*
 Ends the recording, the command buffer stays open. Fails where a barrier is missing between two commands, and names them.
 */
enum olbvh_status olbvh_recording_end(struct olbvh_recording *recording);

/*
 Tells which queries of a recording that has ended have the times of its `index`th stage; fails behind the last.
 */
enum olbvh_status olbvh_recording_stage(const struct olbvh_recording *recording,
                                        uint32_t index,
                                        struct olbvh_stage *out);

/*
 Records a barrier: what was written so far is visible to the compute shaders, transfers and indirect commands that follow.
 */
enum olbvh_status olbvh_cmd_barrier(struct olbvh_recording *recording);

/*
 Records the construction of a scene's tree for the positions there are then. Reads positions and cells in compute shaders, uses memory and scratch in
 compute shaders and transfers, and ends with a barrier as `olbvh_cmd_barrier` records it.
 */
enum olbvh_status olbvh_cmd_build(struct olbvh_recording *recording,
                                  const struct olbvh_scene *scene);

/*
 Records the location of points: compute shaders read mesh, tree and points, and write the answers. No barrier before or after.
 */
enum olbvh_status olbvh_cmd_locate(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_location *location);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OLBVH_H */
