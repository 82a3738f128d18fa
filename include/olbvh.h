/* Finds things inside tetrahedral meshes on any GPU; see README.md.
 *
 * Functions return OLBVH_STATUS_OK or an error code; olbvh_last_error then returns the message, one per thread. A
 * handle keeps alive whatever it was made from, so handles may be freed in any order. Several threads may use one
 * handle at the same time, except a recording, which only one thread may use at a time. Structs and arrays that are
 * passed to a function are read during the call and need not live longer.
 *
 * Pointers: each points to as many elements as its function states, valid during the call and aligned for their type, or
 * is null where the function says so. What a function writes overlaps no other argument, and nothing else uses it
 * meanwhile. Handles are those that this library returned; no handle is used after it was freed, or freed during a call
 * that uses it. Strings end with a zero byte. A call with a misaligned pointer, or with null where that is not allowed,
 * returns OLBVH_STATUS_INVALID; whatever else contradicts this is undefined behaviour. After an error, places of
 * handles and structs are as they were before the call; arrays may have been written in part.
 *
 * Recording: functions olbvh_cmd_... append commands to a command buffer of the host, which may belong to any queue
 * family with compute and must not be inside a render pass. They do not submit, wait, allocate or read back anything.
 * - Memory: sizes are known first. olbvh_plan_measure measures a plan; for every query a function olbvh_..._parts
 *   reports how many bytes of memory the query takes and where in that memory its results will be. Parts of buffers
 *   start at multiples of olbvh_plan_sizes.alignment, and every buffer needs the usage flags given there. The buffers
 *   belong to the host, which keeps them until the commands that use them have been executed.
 * - Errors: a command that returns an error may have recorded a part of its work. The host then does not submit the
 *   command buffer but resets it, and starts the recording again.
 * - Barriers: unless stated otherwise, a command reads its input in compute shaders, uses its memory in compute shaders
 *   and transfers, writes its results in compute shaders, and records no barrier before or after itself. Before
 *   anything reads the results or uses the memory again, the host records olbvh_cmd_barrier, or a barrier of its own
 *   from compute shader and transfer writes to that use. It reports its own barrier with olbvh_recording_host_barrier.
 *
 * Generated from src/capi by cbindgen; `scripts/c_api --write` generates it again. */

#ifndef OLBVH_H
#define OLBVH_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

/*
 Version of this interface. A header and a library with different versions are incompatible.
 */
#define OLBVH_ABI 6

/*
 What stands for an owner where there is none.
 */
#define OLBVH_NONE UINT32_MAX

/*
 The bit of a voxel's owner that says that the voxel is merely touched.
 */
#define OLBVH_TOUCHED 2147483648

/*
 Result of a call.
 */
typedef enum olbvh_status {
  /*
   The call succeeded.
   */
  OLBVH_STATUS_OK = 0,
  /*
   An argument is invalid.
   */
  OLBVH_STATUS_INVALID = 1,
  /*
   There is no Vulkan, no suitable device, or the device failed the self-test.
   */
  OLBVH_STATUS_DEVICE = 2,
  /*
   There is not enough device memory.
   */
  OLBVH_STATUS_MEMORY = 3,
  /*
   The problem is larger than the device or 32-bit offsets allow.
   */
  OLBVH_STATUS_TOO_LARGE = 4,
  /*
   A Vulkan call failed.
   */
  OLBVH_STATUS_VULKAN = 5,
  /*
   Any other error; please report it.
   */
  OLBVH_STATUS_INTERNAL = 6,
  /*
   The device is lost (`VK_ERROR_DEVICE_LOST`): free all handles and start again with a new device.
   */
  OLBVH_STATUS_LOST = 7,
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
 A recording of commands and the descriptor sets that they use: one per frame in flight.
 */
typedef struct olbvh_recording olbvh_recording;

/*
 A mesh and its tree in the host's memory.
 */
typedef struct olbvh_scene olbvh_scene;

/*
 A tree over a mesh.
 */
typedef struct olbvh_tree olbvh_tree;

/*
 How to build a tree. `olbvh_default_build_options` returns the defaults.
 */
typedef struct olbvh_build_options {
  /*
   The paper's alpha, from 0 to 10: how many levels coarser than the size of the tetrahedra the leaves are.
   */
  float alpha;
  /*
   Which octree cells list a tetrahedron. 0: all cells of its bounding box. 1: of these, the cells that no face
   plane of the tetrahedron separates from it. 2: exactly the cells that it touches.
   */
  uint32_t assign;
  /*
   Which leaves have full lists. 0: every leaf lists all its tetrahedra (the paper). 1: only leaves that the
   surface touches; every other leaf has one entry, from which walks across faces find the others.
   */
  uint32_t lists;
  /*
   Level of the leaves, from 1 to 10, which overrides alpha; meshes with thin parts profit from a level finer than
   alpha 0 gives. 0: alpha decides.
   */
  uint32_t level;
  /*
   Whether leaves become finer than that. 0: no. 1: yes where lists are long, which suits location of points,
   slices and overlap. 2: as fine as suits pictures. A recorded build ignores this.
   */
  uint32_t fineness;
  /*
   Not 0: leaves at the surface tell most points beside the mesh without a search, for 4 bytes per leaf and up to a
   third more time of a build. This pays for pictures and slices of thin bodies.
   */
  uint32_t slabs;
  /*
   Maximum number of entries of the tree, which is made coarser until it fits; `olbvh_tree_build` counts those of
   `assign` 0 with full lists, which are more. 0: the usual capacity, 64 entries per tetrahedron and at least 2^20,
   or that of `olbvh_plan`.
   */
  uint32_t capacity;
  /*
   Maximum number of bytes of all arrays of the tree together; it is made coarser until it fits. 0: no limit.
   */
  uint64_t budget;
} olbvh_build_options;

/*
 Properties of a tree.
 */
typedef struct olbvh_tree_info_data {
  /*
   Level of the leaves.
   */
  uint32_t level;
  /*
   Number of entries, that is of (tetrahedron, leaf) pairs.
   */
  uint32_t entries;
  /*
   Number of nodes.
   */
  uint32_t nodes;
  /*
   Number of leaves.
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
   Number of tetrahedra left out because a vertex does not exist, occurs twice, or has a coordinate that is not
   finite or beyond 2^125.
   */
  uint32_t bad_cells;
  /*
   Device time of the construction in milliseconds.
   */
  double build_ms;
  /*
   Device address for `olbvh_open` of olbvh.glsl, valid until the tree is freed; 0 where the device has no buffer
   addresses. If the mesh was reordered, shaders see it in its new order. There is no field, so `olbvh_value` returns
   NaN; scenes can have one (`olbvh_scene_arrays`).
   */
  uint64_t address;
} olbvh_tree_info_data;

/*
 What a host should enable when it creates a device for olbvh.
 */
typedef struct olbvh_host_requirements {
  /*
   The queue family that this library would take for itself, preferably one without graphics. Any family with compute
   works; a renderer takes one with graphics as well.
   */
  uint32_t queue_family;
  /*
   Not 0: the device has the feature `bufferDeviceAddress`. Without it, buffers are bound by descriptors.
   */
  uint32_t buffer_addresses;
  /*
   Not 0: the device has the feature `shaderInt64`.
   */
  uint32_t shader_int64;
  /*
   Not 0: the device has the features `subgroupSizeControl` and `computeFullSubgroups`, and lets compute shaders
   require a subgroup size.
   */
  uint32_t subgroup_size_control;
  /*
   Number of entries in `extensions`.
   */
  uint32_t extension_count;
  /*
   Names of the device extensions to enable. The strings are static: they stay valid and must not be freed.
   */
  const char *extensions[4];
} olbvh_host_requirements;

/*
 A Vulkan device that the host owns; olbvh uses it and never destroys it. Handles are cast to `uint64_t`.
 */
typedef struct olbvh_host_device {
  /*
   `vkGetInstanceProcAddr`, cast to this type.
   */
  void (*get_instance_proc_addr)(void);
  /*
   `VkInstance`, created for Vulkan 1.2 or later.
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
   `VkQueue` of the family `queue_family`, which owning calls submit to (`olbvh_gpu_from_host` with its self-test,
   uploads, builds, queries); recording functions do not touch it. Nothing else may use the queue while an owning
   call runs, or, with `lock_queue`, while it holds that lock. 0: only recording is possible, and the self-test is
   skipped.
   */
  uint64_t queue;
  /*
   Takes the host's lock of the queue, which the host also takes for its own use of it; may be null. It is called
   with `queue_lock` before each submission, on the thread of the owning call, whichever that is. Set both
   `lock_queue` and `unlock_queue`, or neither.
   */
  void (*lock_queue)(void*);
  /*
   Releases the host's lock of the queue; may be null. It is called with `queue_lock` after each submission.
   */
  void (*unlock_queue)(void*);
  /*
   Argument of `lock_queue` and `unlock_queue`.
   */
  void *queue_lock;
  /*
   The host's `VkPipelineCache`, which may hold the kernels of earlier runs; not one that needs external
   synchronization, since threads compile at the same time. 0: a cache that lasts as long as the `olbvh_gpu`.
   */
  uint64_t pipeline_cache;
  /*
   Index of a queue family with compute; it needs no other capability.
   */
  uint32_t queue_family;
  /*
   Not 0: the feature `bufferDeviceAddress` is enabled.
   */
  uint32_t buffer_addresses;
  /*
   Not 0: the feature `shaderInt64` is enabled, from which only drivers for processors profit.
   */
  uint32_t shader_int64;
  /*
   Not 0: `VK_EXT_subgroup_size_control` (or Vulkan 1.3) is enabled with `subgroupSizeControl` and
   `computeFullSubgroups`. Enable it where subgroup sizes vary. Without it, the driver is trusted to run kernels
   with its usual subgroup size, which the self-test checks on opening; Intel devices whose subgroup sizes vary are
   refused.
   */
  uint32_t subgroup_size_control;
  /*
   Not 0: the instance extension `VK_EXT_debug_utils` is enabled.
   */
  uint32_t debug_utils;
} olbvh_host_device;

/*
 What a picture shows. `olbvh_default_picture_settings` returns the defaults.
 */
typedef struct olbvh_picture_settings {
  /*
   Width in pixels.
   */
  uint32_t width;
  /*
   Height in pixels.
   */
  uint32_t height;
  /*
   The camera, in the form of `olbvh render --camera`; null: it sees the whole mesh from an oblique direction.
   */
  const char *camera;
  /*
   Half-spaces that are left out, each in the form of `olbvh render --clip`, separated by spaces; null: none.
   */
  const char *clips;
  /*
   Name of a colour map, as for `olbvh render --tf`; null: the default.
   */
  const char *colors;
  /*
   Opacity, in the form of `olbvh render --opacity`; null: `olbvh_render` adapts it to the field, `olbvh_view_make`
   lets it increase with the value.
   */
  const char *opacity;
  /*
   Values of iso-surfaces, which are drawn instead of the volume.
   */
  float iso[8];
  /*
   Number of values in `iso` that are used; 0: the volume is drawn.
   */
  uint32_t iso_count;
  /*
   Values at the two ends of the colour map. If the first is greater than the second, all values of the field are
   covered.
   */
  float range[2];
  /*
   Distance between two samples in units of the mesh; 0: 1/512 of the diagonal of its bounding box.
   */
  double step;
  /*
   Factor on the opacity: 2 makes the mesh as opaque as if rays travelled twice the distance through it.
   */
  float opacity_scale;
  /*
   A ray ends when its opacity reaches this.
   */
  float termination;
  /*
   Not 0: the surface, and steep changes of the field, are lit.
   */
  uint32_t shading;
  /*
   Minimum opacity of a lit surface that is seen edge-on.
   */
  float outline;
  /*
   Direction to the light: components to the right, upwards, and towards the viewer.
   */
  float light[3];
} olbvh_picture_settings;

/*
 Geometry of a stack of layers of voxels, in the coordinates of the mesh.
 */
typedef struct olbvh_voxels {
  /*
   Centre of voxel (0, 0) of layer 0.
   */
  float origin[3];
  /*
   Vector from one voxel to the next in a row.
   */
  float next_voxel[3];
  /*
   Vector from one row to the next.
   */
  float next_row[3];
  /*
   Vector from one layer to the next.
   */
  float next_layer[3];
  /*
   Half axes of a voxel's box.
   */
  float half[3][3];
  /*
   Number of voxels in a row.
   */
  uint32_t width;
  /*
   Number of rows in a layer.
   */
  uint32_t height;
  /*
   Number of layers.
   */
  uint32_t layers;
} olbvh_voxels;

/*
 A timed stage of a recording.
 */
typedef struct olbvh_stage {
  /*
   Name of the stage, for example "build.levels"; ends with a zero byte.
   */
  char name[64];
  /*
   Index of the query with the time of its start.
   */
  uint32_t begin;
  /*
   Index of the query with the time of its end.
   */
  uint32_t end;
} olbvh_stage;

/*
 What must be known of a mesh and its tree before memory is allocated for them.
 */
typedef struct olbvh_plan {
  /*
   Number of points.
   */
  uint32_t points;
  /*
   Distance from one point to the next in 32-bit floats, at least 3.
   */
  uint32_t stride;
  /*
   Number of tetrahedra.
   */
  uint32_t tets;
  /*
   Deepest level that the leaves may have, from 1 to 10. 0: the level of `build`, or 7 if that has none.
   */
  uint32_t level;
  /*
   Upper bound on the number of entries of a leaf; 0: unknown. If it is too low, points are lost. Location records
   one dispatch for every 16,384 entries, on a GPU at most 16 dispatches.
   */
  uint32_t longest_leaf;
  /*
   How to build the tree. If both a capacity and a budget are given, the smaller one holds. If neither is given,
   there is room for 8 entries per tetrahedron, or 24 if all leaves have full lists. A tree that would need more is
   made coarser. A capacity is at least the number of tetrahedra.
   */
  struct olbvh_build_options build;
} olbvh_plan;

/*
 Memory that a plan needs.
 */
typedef struct olbvh_plan_sizes {
  /*
   Bytes for mesh and tree, kept as long as the tree is queried.
   */
  uint64_t memory;
  /*
   Bytes used only during construction; frames in flight on one queue can share them.
   */
  uint64_t scratch;
  /*
   Offsets of parts of buffers must be multiples of this.
   */
  uint64_t alignment;
  /*
   `VkBufferUsageFlags` that every buffer needs; where buffer addresses are used, they include
   `VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT`.
   */
  uint32_t usage;
} olbvh_plan_sizes;

/*
 A part of one of the host's buffers.
 */
typedef struct olbvh_buffer {
  /*
   `VkBuffer`.
   */
  uint64_t buffer;
  /*
   Offset of the part from the start of the buffer, in bytes.
   */
  uint64_t offset;
  /*
   Size of the part in bytes.
   */
  uint64_t size;
  /*
   Device address of the first byte of the part; 0 where buffer addresses are not enabled.
   */
  uint64_t address;
} olbvh_buffer;

/*
 Where the arrays of a scene are, as olbvh.glsl needs them.
 */
typedef struct olbvh_scene_arrays_data {
  /*
   Content of the buffer whose address is passed to `olbvh_open`, a multiple of 8. With descriptors, this buffer is
   the first binding.
   */
  uint32_t addresses[22];
  /*
   Buffers of the other bindings, in order.
   */
  struct olbvh_buffer bindings[10];
  /*
   An `olbvh_build_status`: what was built.
   */
  struct olbvh_buffer status;
  /*
   An `olbvh_mesh_status`: what is known of the mesh, such as the number of bad tetrahedra.
   */
  struct olbvh_buffer mesh_status;
  /*
   One bit per tetrahedron, lowest bit of a word first: set if it is bad, and so left out of the tree.
   */
  struct olbvh_buffer bad;
} olbvh_scene_arrays_data;

/*
 Points to locate, and where the results go.
 */
typedef struct olbvh_location {
  /*
   Points, three 32-bit floats each.
   */
  struct olbvh_buffer points;
  /*
   Distance from one point to the next in floats, at least 3.
   */
  uint32_t stride;
  /*
   Number of points.
   */
  uint32_t count;
  /*
   Tolerance, as for `olbvh_locate`.
   */
  float tolerance;
  /*
   How points are located. 0: each one independently. 1: each one starting at the owner of the point before it, if
   each point lies near the one before; this pays on processors, from one point per four tetrahedra on. 2: like 0,
   for many points in no order, which are sorted first. 3: sorted first, then like 1, for processors.
   */
  uint32_t path;
  /*
   For path 0, optional (size 0: none): a word per point, the tetrahedron where its search starts, for example its
   owner in the previous frame, or `UINT32_MAX`. It must be a valid tetrahedron of the mesh. The hints may be where
   the owners are: each is read before it is replaced.
   */
  struct olbvh_buffer hints;
  /*
   For paths 2 and 3: scratch memory for the sort, of the size that `olbvh_location_parts` reports.
   */
  struct olbvh_buffer memory;
  /*
   A word per point: its owner, or `UINT32_MAX` if there is none.
   */
  struct olbvh_buffer owners;
  /*
   Four floats per point: barycentric coordinates in the order of the tetrahedron's vertices; zeroes if there is no
   owner.
   */
  struct olbvh_buffer barycentrics;
} olbvh_location;

/*
 Size of the scratch memory for point location.
 */
typedef struct olbvh_location_parts_data {
  /*
   Size of `olbvh_location.memory` in bytes: 0 except for paths 2 and 3.
   */
  uint64_t bytes;
} olbvh_location_parts_data;

/*
 Memory for all owners of points, and where in it the results are.
 */
typedef struct olbvh_owner_parts_data {
  /*
   Size of the memory in bytes.
   */
  uint64_t bytes;
  /*
   A word per point: the one of its owners that `olbvh_cmd_locate` writes.
   */
  struct olbvh_buffer owners;
  /*
   Four floats per point: barycentric coordinates in that owner.
   */
  struct olbvh_buffer barycentrics;
  /*
   A word per point: where its owners end in the list. They start where those of the point before end; those of the
   first point start at 0.
   */
  struct olbvh_buffer ends;
  /*
   A word: the total number of owners of all points, even if there was not room for all of them.
   */
  struct olbvh_buffer total;
} olbvh_owner_parts_data;

/*
 Memory for the closest places of the surface, and where in it the results are.
 */
typedef struct olbvh_nearest_parts_data {
  /*
   Size of the memory in bytes.
   */
  uint64_t bytes;
  /*
   An `olbvh_near_state` per point.
   */
  struct olbvh_buffer states;
  /*
   Four floats per point: barycentric coordinates of the place, in the order of the tetrahedron's vertices; zeroes if
   there is none.
   */
  struct olbvh_buffer barycentrics;
  /*
   A word: the number of points that need another round.
   */
  struct olbvh_buffer unfinished;
} olbvh_nearest_parts_data;

/*
 How many dispatches are recorded for work whose length is not known in advance. Each dispatch does a bounded amount
 of work, so that the device is never kept busy for long. The status of the query says how much is left.
 */
typedef struct olbvh_rounds {
  /*
   Number of dispatches, one after the other; they skip what is finished. At least one, unless they continue work or
   draw a picture.
   */
  uint32_t count;
  /*
   Not 0: continue where an earlier recording of the same query ended.
   */
  uint32_t resume;
} olbvh_rounds;

/*
 A scalar field on a mesh.
 */
typedef struct olbvh_field {
  /*
   One 32-bit float per point or per tetrahedron.
   */
  struct olbvh_buffer values;
  /*
   0: one value per point, interpolated linearly in a tetrahedron. Otherwise: one value per tetrahedron.
   */
  uint32_t on_cells;
} olbvh_field;

/*
 What a picture shows, in the form that the device reads. `olbvh_view_make` fills it; the host copies it unchanged to
 `olbvh_picture.view`.
 */
typedef struct olbvh_view {
  /*
   Rays, clips, light, step, range of values, and values of iso-surfaces.
   */
  uint32_t frame[64];
  /*
   The transfer function over the range of values: colour, and opacity of one step or of one surface.
   */
  float table[1024][4];
  /*
   Ranges of values outside of which nothing is visible, ascending and disjoint. Unused ranges at the end contain
   no value.
   */
  float drawn[512][2];
  /*
   Number of ranges in `drawn` that are used.
   */
  uint32_t drawn_count;
} olbvh_view;

/*
 What is drawn, and where. The contents of the buffers are read when the commands are executed, so a new view or new
 values need no new recording.
 */
typedef struct olbvh_picture {
  /*
   Width in pixels.
   */
  uint32_t width;
  /*
   Height in pixels.
   */
  uint32_t height;
  /*
   Not 0: the iso-surfaces of the view are drawn instead of the volume.
   */
  uint32_t iso;
  /*
   Used if `ranges` is given: how many ranges of the view are considered, at least its own `drawn_count`, up to
   512.
   */
  uint32_t drawn_count;
  /*
   Buffer with an `olbvh_view`.
   */
  struct olbvh_buffer view;
  /*
   The field that is drawn.
   */
  struct olbvh_field field;
  /*
   Optional (size 0: no lighting): three floats per point of the mesh, normals of length up to 1 by which the
   volume is lit.
   */
  struct olbvh_buffer normals;
  /*
   Optional (size 0: nothing is skipped): the ranges that `olbvh_cmd_ranges` records for the field, by which nodes
   without visible values are skipped. The picture is the same either way.
   */
  struct olbvh_buffer ranges;
  /*
   Optional (size 0: everything is drawn): a depth buffer, behind which nothing is drawn. One float per pixel, upper row
   first, such as a copy of a depth attachment (`D32_SFLOAT`) has; with a view of `olbvh_view_make` the distance from
   the eye along the axis of the view, with one of `olbvh_view_make_projected` what Vulkan wrote there.
   */
  struct olbvh_buffer depth;
  /*
   Memory of the size that `olbvh_picture_parts` reports.
   */
  struct olbvh_buffer memory;
  /*
   A round takes up to 1,024 samples of every ray. A `count` of 0 without `resume` prepares the picture and leaves
   it empty.
   */
  struct olbvh_rounds rounds;
} olbvh_picture;

/*
 Memory for a picture, and where in it the results are.
 */
typedef struct olbvh_picture_parts_data {
  /*
   Size of the memory in bytes.
   */
  uint64_t bytes;
  /*
   Four floats per pixel, upper row first: colour multiplied by its opacity, and opacity.
   */
  struct olbvh_buffer colors;
  /*
   An `olbvh_picture_status`.
   */
  struct olbvh_buffer status;
} olbvh_picture_parts_data;

/*
 Which voxels are sliced, and where the results go.
 */
typedef struct olbvh_slicing {
  /*
   The whole stack.
   */
  struct olbvh_voxels voxels;
  /*
   Layer of the first row that is sliced now.
   */
  uint32_t layer;
  /*
   Number of this row in its layer.
   */
  uint32_t first;
  /*
   Number of rows; the last row of a layer is followed by the first row of the next. If whole layers are sliced, or
   parts of one layer that start at multiples of 64 rows, voxels have the same owners as in the whole stack even
   where tetrahedra overlap.
   */
  uint32_t rows;
  /*
   Which value touched voxels get, as for `olbvh_slice`.
   */
  uint32_t linear;
  /*
   Optional (`values` of size 0: none): the field.
   */
  struct olbvh_field field;
  /*
   Memory of the size that `olbvh_slicing_parts` reports.
   */
  struct olbvh_buffer memory;
  /*
   Rounds of the search; one is enough unless leaves hold thousands of tetrahedra.
   */
  struct olbvh_rounds rounds;
} olbvh_slicing;

/*
 Memory for a slice, and where in it the results are.
 */
typedef struct olbvh_slicing_parts_data {
  /*
   Size of the memory in bytes: 28 per voxel, and 32 per run of 64 voxels in the same column of a layer.
   */
  uint64_t bytes;
  /*
   A word per voxel, row by row, as for `olbvh_slice`.
   */
  struct olbvh_buffer answers;
  /*
   A float per voxel: the value, NaN if the voxel is empty; not written without a field.
   */
  struct olbvh_buffer values;
  /*
   An `olbvh_slice_status`.
   */
  struct olbvh_buffer status;
} olbvh_slicing_parts_data;

/*
 Memory for the overlap of two meshes, and where in it the results are.
 */
typedef struct olbvh_overlap_parts_data {
  /*
   Size of the memory in bytes.
   */
  uint64_t bytes;
  /*
   For A and for B: one bit per tetrahedron, lowest bit of a word first, set if it intersects the other mesh.
   */
  struct olbvh_buffer hits[2];
  /*
   For A and for B: an `olbvh_overlap_status`. The bits of unfinished tetrahedra are 0.
   */
  struct olbvh_buffer status[2];
} olbvh_overlap_parts_data;

/*
 Memory for the pairs of two meshes, and where in it the results are.
 */
typedef struct olbvh_pair_parts_data {
  /*
   Size of the memory in bytes.
   */
  uint64_t bytes;
  /*
   An `olbvh_overlap_status` for A.
   */
  struct olbvh_buffer status;
} olbvh_pair_parts_data;

/*
 The result of `olbvh_cmd_build`, which the device writes to `olbvh_scene_arrays_data.status`.
 */
typedef struct olbvh_build_status {
  /*
   Level of the leaves.
   */
  uint32_t level;
  /*
   Level before the limits, by alpha or as requested; `level` is smaller where a limit lowered it.
   */
  uint32_t wanted_level;
  /*
   Number of octree cells in the bounding boxes of all tetrahedra, of which the entries are chosen.
   */
  uint32_t candidates;
  /*
   Number of entries, that is of (tetrahedron, leaf) pairs.
   */
  uint32_t entries;
  /*
   Number of nodes.
   */
  uint32_t nodes;
  /*
   Number of internal nodes.
   */
  uint32_t internal;
  /*
   Number of leaves.
   */
  uint32_t leaves;
  /*
   Number of leaves that the surface of the mesh may pass through.
   */
  uint32_t boundary_leaves;
  /*
   Number of entries of the longest leaf, for `olbvh_plan.longest_leaf`.
   */
  uint32_t longest_leaf;
  /*
   Bit k: on level k, some tetrahedron has more than 32 candidates.
   */
  uint32_t large_levels;
  /*
   Sum of the estimates from which the level by alpha follows, lower word first.
   */
  uint32_t sum[2];
  /*
   Number of candidates on every level from 0 to 10, two words each, lower word first.
   */
  uint32_t total[22];
  /*
   Element k is the number of nodes on levels 0 to k.
   */
  uint32_t levels[11];
  /*
   Not 0: the tree is empty, since its capacity is too small even for a single node; that of a plan never is.
   */
  uint32_t overflow;
} olbvh_build_status;

/*
 What is known of a mesh, which the device writes to `olbvh_scene_arrays_data.mesh_status`.
 */
typedef struct olbvh_mesh_status {
  /*
   Lower corner of the bounds, in a form of the kernels.
   */
  uint32_t lo[3];
  /*
   Upper corner of the bounds, in a form of the kernels.
   */
  uint32_t hi[3];
  /*
   Number of bad tetrahedra, which the tree leaves out: a vertex does not exist, occurs twice, or has a coordinate
   that is not finite or beyond 2^125.
   */
  uint32_t bad;
  /*
   Number of boundary tetrahedra: those on the surface, without volume, beside a fold, or at a crowded vertex.
   */
  uint32_t boundary;
  /*
   Number of tetrahedra without volume.
   */
  uint32_t zero_volume;
  /*
   Number of tetrahedra of negative volume, in the order of their vertices; they are as good as others.
   */
  uint32_t negative;
  /*
   Number of crowded vertices, at which more than 128 tetrahedra may meet.
   */
  uint32_t crowded;
  /*
   Not 0: the table of faces is full, as it can be beyond 429 million tetrahedra only. The tree must not be used.
   */
  uint32_t overflow;
  /*
   Number of faces that more than two tetrahedra share, none of which are neighbours there.
   */
  uint32_t branched;
  /*
   Not 0: since `olbvh_cmd_build`, some tetrahedra were bad for a while and have lost their neighbours.
   */
  uint32_t parted;
} olbvh_mesh_status;

/*
 State of the search for the place of the surface that is closest to a point, which the device writes to
 `olbvh_nearest_parts_data.states`.
 */
typedef struct olbvh_near_state {
  /*
   Where the search goes on in another round; `UINT32_MAX`: it has ended.
   */
  uint32_t code;
  /*
   How much of the leaf there is done.
   */
  uint32_t entry;
  /*
   The tetrahedron with the closest place, or `UINT32_MAX`.
   */
  uint32_t owner;
  /*
   Squared distance times (s · 2^19)², infinite without a place. s is the power of two that brings the largest extent
   of the mesh into [1, 2): `scale` of `olbvh_Grid` in olbvh.glsl, the first of `olbvh_scene_arrays_data.bindings`.
   */
  float square;
} olbvh_near_state;

/*
 Progress of a picture, which the device writes to `olbvh_picture_parts_data.status`. Numbers of two words have the
 lower one first.
 */
typedef struct olbvh_picture_status {
  /*
   Number of rays that may meet the mesh, and of some beside them.
   */
  uint32_t met;
  /*
   Number of samples taken.
   */
  uint32_t samples[2];
  /*
   Number of samples in the mesh.
   */
  uint32_t found[2];
  /*
   Number of samples skipped, in nodes without visible values.
   */
  uint32_t skipped[2];
  /*
   Number of rays that need another round.
   */
  uint32_t unfinished;
} olbvh_picture_status;

/*
 Progress and result of a slice, which the device writes to `olbvh_slicing_parts_data.status`. No result may be used,
 and the numbers of voxels say nothing, until `locating` and `touching` are 0.
 */
typedef struct olbvh_slice_status {
  /*
   Number of runs of voxels that need another round for their centres.
   */
  uint32_t locating;
  /*
   Number of voxels that need another round for their boxes.
   */
  uint32_t touching;
  /*
   Why all voxels are empty: 1 if the boxes are flat, 2 if they are larger than two to four times the mesh. 0
   otherwise.
   */
  uint32_t refused;
  /*
   Number of voxels whose centre lies in the mesh.
   */
  uint32_t inside;
  /*
   Number of voxels that the mesh merely touches.
   */
  uint32_t touched;
  /*
   Number of voxels that the mesh does not touch.
   */
  uint32_t empty;
} olbvh_slice_status;

/*
 Progress of the search for the tetrahedra of one mesh that intersect another, or for the pairs of A, which the device
 writes to `status` of `olbvh_overlap_parts_data` or `olbvh_pair_parts_data`. Numbers of two words have the lower one
 first.
 */
typedef struct olbvh_overlap_status {
  /*
   Number of tetrahedra that are searched for in the other tree, since no vertex decides. This number and the next
   three are 0 for pairs.
   */
  uint32_t waiting;
  /*
   Number of tetrahedra with a vertex in the other mesh, or that contain one of its vertices.
   */
  uint32_t by_vertex;
  /*
   Number of tetrahedra that touch a node inside of the other mesh.
   */
  uint32_t by_node;
  /*
   Number of vertices that had to be located in the list of a leaf.
   */
  uint32_t located;
  /*
   Number of tetrahedra that need another round of `olbvh_cmd_overlap` or `olbvh_cmd_count_pairs`.
   */
  uint32_t unfinished;
  /*
   Number of tetrahedra that need another round of `olbvh_cmd_list_pairs`, which does nothing before `unfinished` is 0.
   */
  uint32_t unfilled;
  /*
   Number of tests of two tetrahedra.
   */
  uint32_t narrow[2];
  /*
   Number of pairs, whether or not there was room for them. From 2^32 on, none is written.
   */
  uint32_t pairs[2];
  /*
   Not 0: nothing intersects, since a mesh has no valid tetrahedron, or a tree does not fit its capacity.
   */
  uint32_t empty;
  /*
   Unused.
   */
  uint32_t pad;
} olbvh_overlap_status;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Text of the last error of this thread, which calls that succeed keep; empty if there was none. Valid until the next
 call of this thread.
 */
const char *olbvh_last_error(void);

/*
 Version of the library, for example "0.1.0".
 */
const char *olbvh_version(void);

/*
 Returns the `OLBVH_ABI` of the library, for comparison with that of the header.
 */
uint32_t olbvh_abi(void);

/*
 Opens a device, chosen by a part of its name or by its number; null selects the best suitable device.
 */
enum olbvh_status olbvh_gpu_open(const char *device,
                                 struct olbvh_gpu **out);

/*
 Frees the handle of a device; null is allowed.
 */
void olbvh_gpu_free(struct olbvh_gpu *gpu);

/*
 Uploads a mesh to the device: three floats per point, four indices per tetrahedron. Invalid tetrahedra are left out
 and counted (`olbvh_tree_info`). If `reorder` is not 0, points and tetrahedra are first sorted along a Z-order
 curve, which pays where they come in no spatial order; all functions still take and return the caller's numbers. Of
 the tetrahedra that share a face, edge or vertex, the first along the curve then owns its points, instead of the one
 with the lowest number.
 */
enum olbvh_status olbvh_mesh_upload(const struct olbvh_gpu *gpu,
                                    const float *points,
                                    size_t point_count,
                                    const uint32_t *tets,
                                    size_t tet_count,
                                    uint32_t reorder,
                                    struct olbvh_mesh **out);

/*
 The same tetrahedra with their points elsewhere, as a simulation moves them: three floats for each point of `mesh`, which
 stays as it is, like its trees. Neighbours, whose search takes most of the time of an upload, are taken over, unless the
 mesh has invalid tetrahedra.
 */
enum olbvh_status olbvh_mesh_moved(const struct olbvh_mesh *mesh,
                                   const float *points,
                                   struct olbvh_mesh **out);

/*
 Frees the handle of a mesh; null is allowed.
 */
void olbvh_mesh_free(struct olbvh_mesh *mesh);

/*
 The default build options, which `olbvh_tree_build` also uses when its `options` are null.
 */
struct olbvh_build_options olbvh_default_build_options(void);

/*
 Builds the tree over a mesh. `options` may be null: the defaults.
 */
enum olbvh_status olbvh_tree_build(const struct olbvh_mesh *mesh,
                                   const struct olbvh_build_options *options,
                                   struct olbvh_tree **out);

/*
 Frees the handle of a tree; null is allowed.
 */
void olbvh_tree_free(struct olbvh_tree *tree);

/*
 Reports the properties of a tree.
 */
enum olbvh_status olbvh_tree_info(const struct olbvh_tree *tree, struct olbvh_tree_info_data *out);

/*
 Reports what to enable on a physical device, before a device is created from it. Handles are cast to `uint64_t`,
 `vkGetInstanceProcAddr` to a function without arguments. Returns `OLBVH_STATUS_DEVICE` if the physical device does
 not qualify; `olbvh_last_error` then says what it lacks.
 */
enum olbvh_status olbvh_host_check(void (*get_instance_proc_addr)(void),
                                   uint64_t instance,
                                   uint64_t physical_device,
                                   struct olbvh_host_requirements *out);

/*
 Makes a handle for the host's device, which must outlive everything made from the handle, and so must whatever else
 `host` refers to: its functions, `queue_lock` and the pipeline cache. Buffers are used by queues of that family alone,
 with exclusive sharing: a host that reads or writes them on another family transfers their ownership.
 */
enum olbvh_status olbvh_gpu_from_host(const struct olbvh_host_device *host,
                                      struct olbvh_gpu **out);

/*
 Finds the owner of each of `count` points (three floats each): a tetrahedron, or `UINT32_MAX` if the point lies
 outside of the mesh. `barycentrics` gets four floats per point, in the order of the tetrahedron's vertices; it may
 be null. A point slightly outside of the mesh is accepted if its smallest barycentric coordinate in the nearest
 tetrahedron is at least `-tolerance`; a negative `tolerance` selects the default, 1e-5.
 */
enum olbvh_status olbvh_locate(const struct olbvh_tree *tree,
                               const float *points,
                               size_t count,
                               float tolerance,
                               uint32_t *owners,
                               float *barycentrics);

/*
 Samples a field at `count` points (three floats each). `values` has `components` floats, 1 or more, for each point of the
 mesh, or for each tetrahedron if `on_cells` is not 0, such as the three of a velocity next to each other. `results` gets
 as many for each point, NaN outside of the mesh. `tolerance` as for `olbvh_locate`.
 */
enum olbvh_status olbvh_sample(const struct olbvh_tree *tree,
                               const float *points,
                               size_t count,
                               float tolerance,
                               const float *values,
                               uint32_t components,
                               uint32_t on_cells,
                               float *results);

/*
 Finds the place of the mesh's surface that is closest to each of `count` points (three floats each), inside or outside:
 the tetrahedron with it, or `OLBVH_NONE` if none is at most `within` away, a length like the coordinates. However large
 `within` is, places farther away than some limit, which lies between half of the mesh's largest extent and all of it,
 are not found. `barycentrics` gets four floats per point, in the order of the tetrahedron's vertices, and `distances`
 one, NaN without a place; each of these two may be null.
 */
enum olbvh_status olbvh_nearest(const struct olbvh_tree *tree,
                                const float *points,
                                size_t count,
                                float within,
                                uint32_t *owners,
                                float *barycentrics,
                                float *distances);

/*
 The default settings of pictures.
 */
struct olbvh_picture_settings olbvh_default_picture_settings(void);

/*
 Draws a field as a picture. `values` has a float per point, or per tetrahedron if `on_cells` is not 0. `pixels` gets
 four floats per pixel, upper row first: colour (sRGB, 0 to 1) multiplied by its opacity, and opacity. The caller
 adds the background. The mesh is read back to host memory, once, when settings first need it there: with shading, or
 if `opacity`, `range`, or `eye` of `camera` is not given.
 */
enum olbvh_status olbvh_render(const struct olbvh_tree *tree,
                               const struct olbvh_picture_settings *settings,
                               const float *values,
                               uint32_t on_cells,
                               float *pixels);

/*
 Slices a mesh conservatively: no voxel that the mesh touches is left empty. `answers`, if not null, gets a word per
 voxel, layer by layer and row by row: the tetrahedron that contains its centre; if there is none, 2^31 plus the
 tetrahedron nearest to its centre of those that touch its box; `UINT32_MAX` if the voxel is empty. `results`, if not
 null, gets a float per voxel: the value of the field (`values` and `on_cells` as for `olbvh_render`; not read if
 `results` is null), NaN if the voxel is empty. A voxel that is merely touched gets the value at the tetrahedron's point
 nearest to its centre or, if `linear` is not 0, the tetrahedron's linear field extrapolated to its centre.
 */
enum olbvh_status olbvh_slice(const struct olbvh_tree *tree,
                              const struct olbvh_voxels *voxels,
                              const float *values,
                              uint32_t on_cells,
                              uint32_t linear,
                              uint32_t *answers,
                              float *results);

/*
 Finds the tetrahedra of each mesh that intersect the other mesh. The points of both meshes are in the same
 coordinate system. In `hits_a` and `hits_b`, bit i % 32 of word i / 32 is set if tetrahedron i intersects the other
 mesh; each gets one word per 32 tetrahedra, rounded up. Both trees must have been made with the same `olbvh_gpu`.
 */
enum olbvh_status olbvh_overlap(const struct olbvh_tree *a,
                                const struct olbvh_tree *b,
                                uint32_t *hits_a,
                                uint32_t *hits_b);

/*
 Finds every tetrahedron that contains each of `count` points (three floats each); for a point that none contains, its
 owner within the tolerance, if there is one, alone. `ends` gets for each point where its tetrahedra end in `found`; they
 are ascending, and start where those of the point before end. `found` has room for `room` of them, and `total` gets the
 number of all: where that is greater, those that fit are written; call again with more room. Where tetrahedra overlap,
 only a tree with `lists` 0 finds all.
 */
enum olbvh_status olbvh_locate_all(const struct olbvh_tree *tree,
                                   const float *points,
                                   size_t count,
                                   float tolerance,
                                   uint64_t *ends,
                                   uint32_t *found,
                                   size_t room,
                                   uint64_t *total);

/*
 Finds all pairs of a tetrahedron of A and one of B that intersect, as `olbvh_overlap` finds the tetrahedra: two numbers
 for each pair, ascending by A, then by B. `pairs` has room for `room` pairs, and `total` gets the number of all: where
 that is greater, those that fit are written; call again with more room. The tree over B must have `lists` 0.
 */
enum olbvh_status olbvh_overlap_pairs(const struct olbvh_tree *a,
                                      const struct olbvh_tree *b,
                                      uint32_t *pairs,
                                      size_t room,
                                      uint64_t *total);

/*
 Makes a recording: one per frame in flight, used by one thread at a time.
 */
enum olbvh_status olbvh_recording_new(const struct olbvh_gpu *gpu, struct olbvh_recording **out);

/*
 Frees a recording after its commands have been executed; null is allowed.
 */
void olbvh_recording_free(struct olbvh_recording *recording);

/*
 Starts a recording and forgets the previous one, whose commands must have been executed. `commands` is a
 `VkCommandBuffer` in the recording state, outside of a render pass. If it is 0, the recording is a rehearsal:
 commands compile the pipelines that they need, and the end reserves room for their descriptor sets, so that
 recording the same commands later creates nothing. `queries` is a reset `VkQueryPool` of `query_count` timestamp
 queries, or 0; stages are timed as long as queries are left, and not at all if the queue family has no timestamps
 (`timestampValidBits` 0). The recording binds a compute pipeline, push constants, and descriptor set 0 where the
 device has no buffer addresses.
 */
enum olbvh_status olbvh_recording_begin(struct olbvh_recording *recording,
                                        uint64_t commands,
                                        uint64_t queries,
                                        uint32_t query_count);

/*
 Ends the recording; the command buffer stays in the recording state. Returns an error that names both commands if a
 barrier is missing between two of them.
 */
enum olbvh_status olbvh_recording_end(struct olbvh_recording *recording);

/*
 Reports which queries hold the times of stage `index` (from 0) of a recording that has ended; returns an error if
 there is no such stage.
 */
enum olbvh_status olbvh_recording_stage(const struct olbvh_recording *recording,
                                        uint32_t index,
                                        struct olbvh_stage *out);

/*
 Records a barrier: what was written so far becomes visible to the compute shaders, transfers and indirect commands
 that follow.
 */
enum olbvh_status olbvh_cmd_barrier(struct olbvh_recording *recording);

/*
 States that the host itself recorded a barrier at this place, equivalent to `olbvh_cmd_barrier` or stronger, so that
 `olbvh_recording_end` does not report one missing. Records nothing.
 */
enum olbvh_status olbvh_recording_host_barrier(struct olbvh_recording *recording);

/*
 Reports how much memory a plan needs.
 */
enum olbvh_status olbvh_plan_measure(const struct olbvh_gpu *gpu,
                                     const struct olbvh_plan *plan,
                                     struct olbvh_plan_sizes *out);

/*
 Makes a scene for a plan. `positions` (32-bit floats, three per point at the distance of the plan's `stride`) and `cells`
 (four indices per tetrahedron) are read whenever its tree is built; `memory` and `scratch` have the sizes that
 `olbvh_plan_measure` reported. The host keeps the buffers as long as it records with the scene.
 */
enum olbvh_status olbvh_scene_place(const struct olbvh_gpu *gpu,
                                    const struct olbvh_plan *plan,
                                    struct olbvh_buffer positions,
                                    struct olbvh_buffer cells,
                                    struct olbvh_buffer memory,
                                    struct olbvh_buffer scratch,
                                    struct olbvh_scene **out);

/*
 Frees a scene, but not its buffers; null is allowed.
 */
void olbvh_scene_free(struct olbvh_scene *scene);

/*
 Reports where the arrays of a scene are. `field`, a float per point, may be null or of size 0: none.
 */
enum olbvh_status olbvh_scene_arrays(const struct olbvh_scene *scene,
                                     const struct olbvh_buffer *field,
                                     struct olbvh_scene_arrays_data *out);

/*
 Records the construction of a scene's tree for the positions at the time of execution. Reads positions and cells in
 compute shaders, uses memory and scratch in compute shaders and transfers, and ends with a barrier like that of
 `olbvh_cmd_barrier`.
 */
enum olbvh_status olbvh_cmd_build(struct olbvh_recording *recording,
                                  const struct olbvh_scene *scene);

/*
 As `olbvh_cmd_build`, for positions that have changed since a tree of the scene was built: neighbours, whose search
 takes much of that time, stay as they were found then. The cells must be the same. A tetrahedron that was or becomes
 bad, see `olbvh_mesh_status.bad`, has no neighbours until the next `olbvh_cmd_build`, and `parted` is not 0 until then: no
 point is lost, but the tree is larger, and places inside may count as surface for `olbvh_cmd_nearest`.
 */
enum olbvh_status olbvh_cmd_rebuild(struct olbvh_recording *recording,
                                    const struct olbvh_scene *scene);

/*
 Reports how much scratch memory the location needs besides the results.
 */
enum olbvh_status olbvh_location_parts(const struct olbvh_scene *scene,
                                       const struct olbvh_location *location,
                                       struct olbvh_location_parts_data *out);

/*
 Records the location of points.
 */
enum olbvh_status olbvh_cmd_locate(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_location *location);

/*
 Reports how much memory all owners of the points need, and where in `memory` (size 0 if it does not exist yet) the
 results are.
 */
enum olbvh_status olbvh_owner_parts(const struct olbvh_scene *scene,
                                    const struct olbvh_location *location,
                                    struct olbvh_buffer memory,
                                    struct olbvh_owner_parts_data *out);

/*
 Records the search for all owners of points, that is for all tetrahedra that contain each of them: a word each in
 `found`, point by point, ascending for each point. Only as many as fit `found` are written; `ends` and `total` of
 `olbvh_owner_parts` are correct in any case, modulo 2^32. Where tetrahedra overlap each other, only a tree with full
 lists (`lists` of `olbvh_build_options` 0) finds all of them. Of `location`, only points, stride, count and tolerance
 are used.
 */
enum olbvh_status olbvh_cmd_owners(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_location *location,
                                   struct olbvh_buffer memory,
                                   struct olbvh_buffer found);

/*
 Reports how much memory the closest places of the surface need for `count` points, and where in `memory` (size 0 if it
 does not exist yet) the results are.
 */
enum olbvh_status olbvh_nearest_parts(uint32_t count,
                                      struct olbvh_buffer memory,
                                      struct olbvh_nearest_parts_data *out);

/*
 Records the search for the place of the surface that is closest to each point, as `olbvh_nearest` finds it. Of
 `location`, only points, stride and count are used, and memory, if the path is 2 or 3: points in no order are found
 faster if they are sorted first. `unfinished` of `olbvh_nearest_parts` says whether more rounds are
 needed; until then, a point has no coordinates yet, and its tetrahedron need not be the closest. Points deep inside take
 many rounds: in a grid of 32 x 32 x 32 cubes, 27 for points anywhere, 54 around its middle.
 */
enum olbvh_status olbvh_cmd_nearest(struct olbvh_recording *recording,
                                    const struct olbvh_scene *scene,
                                    const struct olbvh_location *location,
                                    float within,
                                    struct olbvh_buffer memory,
                                    struct olbvh_rounds rounds);

/*
 Records the interpolation of a field at points that have been located. `field` has `components` floats for each point or
 tetrahedron of the mesh, such as 3 of a velocity, and `values` gets as many for each located point, NaN for one without
 an owner. Of `location`, only count, owners and barycentrics are used; compute shaders read the latter two.
 */
enum olbvh_status olbvh_cmd_interpolate(struct olbvh_recording *recording,
                                        const struct olbvh_scene *scene,
                                        const struct olbvh_location *location,
                                        const struct olbvh_field *field,
                                        uint32_t components,
                                        struct olbvh_buffer values);

/*
 Computes what a picture shows of a mesh whose points lie in the box from `lo` to `hi`, three floats each. The camera
 is placed relative to this box, and default lengths are fractions of its diagonal. If the settings give no range of
 values, it is 0 to 1.
 */
enum olbvh_status olbvh_view_make(const struct olbvh_picture_settings *settings,
                                  const float *lo,
                                  const float *hi,
                                  struct olbvh_view *out);

/*
 As `olbvh_view_make`, but the mesh appears where a renderer sees it, and not in the view of the settings' camera.
 `to_clip` has 16 numbers, column by column: the matrix (projection · view · model) that takes points of the mesh to
 Vulkan's clip space, whose y points down; negate the second row of a matrix that is used with a viewport of negative
 height. If `reversed` is not 0, the near plane has depth 1 and what is far depth 0, otherwise it is the other way round.
 */
enum olbvh_status olbvh_view_make_projected(const struct olbvh_picture_settings *settings,
                                            const float *lo,
                                            const float *hi,
                                            const double *to_clip,
                                            uint32_t reversed,
                                            struct olbvh_view *out);

/*
 Reports how many bytes the ranges of a field take.
 */
enum olbvh_status olbvh_range_bytes(const struct olbvh_scene *scene, uint64_t *out);

/*
 Records the computation of the smallest and the largest value of a field in every node of the tree, into `ranges`.
 New values of the field need only this, not a new tree. Starts with a transfer write and ends with a barrier like
 that of `olbvh_cmd_barrier`.
 */
enum olbvh_status olbvh_cmd_ranges(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_field *field,
                                   struct olbvh_buffer ranges);

/*
 Reports how much memory a picture needs, and where in its `memory` (size 0 if it does not exist yet) the results
 are.
 */
enum olbvh_status olbvh_picture_parts(const struct olbvh_scene *scene,
                                      const struct olbvh_picture *picture,
                                      struct olbvh_picture_parts_data *out);

/*
 Records the drawing of a picture. If nodes are skipped, transfers read the tree as well.
 */
enum olbvh_status olbvh_cmd_render(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_picture *picture);

/*
 Records what a depth buffer has where the rays of a picture became opaque: at an opaque iso-surface, or where the volume
 reached the opacity at which rays end. `depths` has a float per pixel, upper row first; other pixels keep their values,
 so that it may be the `depth` of the picture itself. Copied to a depth attachment, it hides what is drawn behind. To be
 recorded after the last round of `olbvh_cmd_render` and an `olbvh_cmd_barrier`.
 */
enum olbvh_status olbvh_cmd_depths(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_picture *picture,
                                   struct olbvh_buffer depths);

/*
 Reports how much memory a slice needs, and where in its `memory` (size 0 if it does not exist yet) the results are.
 */
enum olbvh_status olbvh_slicing_parts(const struct olbvh_slicing *slicing,
                                      struct olbvh_slicing_parts_data *out);

/*
 Records the slicing of rows of voxels. Transfers write the status as well.
 */
enum olbvh_status olbvh_cmd_slice(struct olbvh_recording *recording,
                                  const struct olbvh_scene *scene,
                                  const struct olbvh_slicing *slicing);

/*
 Reports how much memory the overlap of two meshes needs, and where in `memory` (size 0 if it does not exist yet) the
 results are.
 */
enum olbvh_status olbvh_overlap_parts(const struct olbvh_scene *a,
                                      const struct olbvh_scene *b,
                                      struct olbvh_buffer memory,
                                      struct olbvh_overlap_parts_data *out);

/*
 Records the search for the tetrahedra of A that intersect B, and of B that intersect A. The points of both meshes
 are in the same coordinate system. Three rounds are enough for most meshes.
 */
enum olbvh_status olbvh_cmd_overlap(struct olbvh_recording *recording,
                                    const struct olbvh_scene *a,
                                    const struct olbvh_scene *b,
                                    struct olbvh_buffer memory,
                                    struct olbvh_rounds rounds);

/*
 Reports how much memory the pairs of A with another mesh need, and where in `memory` (size 0 if it does not exist
 yet) the status is.
 */
enum olbvh_status olbvh_pair_parts(const struct olbvh_scene *a,
                                   struct olbvh_buffer memory,
                                   struct olbvh_pair_parts_data *out);

/*
 Records the counting of the pairs of a tetrahedron of A and one of B that touch. The tree over B must have full
 lists (`lists` 0). Unless its `assign` is 0, a pair is counted once for every leaf that lists both.
 */
enum olbvh_status olbvh_cmd_count_pairs(struct olbvh_recording *recording,
                                        const struct olbvh_scene *a,
                                        const struct olbvh_scene *b,
                                        struct olbvh_buffer memory,
                                        struct olbvh_rounds rounds);

/*
 Records the writing of the pairs, after they have been counted: two words each in `found`, the tetrahedron of A and
 that of B, ascending by A. Only as many as fit `found` are written. Starts with a barrier; if it continues where an
 earlier recording ended, it starts with a transfer write of the status.
 */
enum olbvh_status olbvh_cmd_list_pairs(struct olbvh_recording *recording,
                                       const struct olbvh_scene *a,
                                       const struct olbvh_scene *b,
                                       struct olbvh_buffer memory,
                                       struct olbvh_buffer found,
                                       struct olbvh_rounds rounds);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OLBVH_H */
