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
   Most entries the tree may have; it gets coarser until it fits. 0: no limit.
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

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OLBVH_H */
