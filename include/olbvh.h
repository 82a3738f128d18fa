/* Finds things inside tetrahedral meshes on any GPU; see README.md.
 *
 * Functions return OLBVH_STATUS_OK or the code of an error, whose text olbvh_last_error gives. A handle keeps what it was made from alive, so the order of
 * freeing means nothing. One handle may be used by many threads at a time, a recording by one. Structs and arrays are read during the call.
 *
 * Recording: olbvh_cmd_... append to a command buffer of the host's, of any queue family with compute, outside of a render pass. Nothing is submitted, waited
 * for, allocated or read back. Sizes come first: a plan is measured, and for every query a function ..._parts tells how many bytes its memory takes and where
 * in it the answers will be; parts of buffers begin at multiples of olbvh_plan_sizes.alignment, and all buffers have its usage flags. They are the host's and
 * stay as long as commands that use them are executed. Where nothing else is said, a command reads what it is given in compute shaders, uses its memory in
 * compute shaders and transfers, writes its answers in compute shaders, and no barrier stands before or behind it: the host records olbvh_cmd_barrier, or a
 * barrier of its own that it tells of by olbvh_recording_host_barrier, from compute shader and transfer writes to whatever reads the answers or uses the
 * memory next.
 *
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
  /*
   The device is lost (`VK_ERROR_DEVICE_LOST`): free all handles, and begin again with another device.
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
   Level of the leaves whatever alpha says, 1 to 10: one finer than alpha 0 asks for suits thin parts. 0: as alpha says.
   */
  uint32_t level;
  /*
   How fine leaves are beyond that: 0: as it says. 1: finer where lists are long, as suits points, slices and overlap. 2: as suits pictures. A recorded
   build takes no notice.
   */
  uint32_t fineness;
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
   Device address for `olbvh_open` of olbvh.glsl; 0 where the device has no buffer addresses. Shaders see a mesh that was reordered in its new order, and no
   field: `olbvh_value` is NaN there. Scenes have fields (`olbvh_scene_arrays`).
   */
  uint64_t address;
} olbvh_tree_info_data;

/*
 What a host enables when it makes a device for olbvh.
 */
typedef struct olbvh_host_requirements {
  /*
   The first queue family with compute; any other with compute will do.
   */
  uint32_t queue_family;
  /*
   Not 0: the device has the feature `bufferDeviceAddress`. Without it, buffers are bound by descriptors.
   */
  uint32_t buffer_addresses;
  /*
   Not 0: it has the feature `shaderInt64`.
   */
  uint32_t shader_int64;
  /*
   Not 0: it has the features `subgroupSizeControl` and `computeFullSubgroups`, and heeds them.
   */
  uint32_t subgroup_size_control;
  /*
   Number of names that follow.
   */
  uint32_t extension_count;
  /*
   Names of device extensions, which stay where they are.
   */
  const char *extensions[4];
} olbvh_host_requirements;

/*
 A Vulkan device of the host's, to be used and never destroyed by olbvh. Handles are cast to `uint64_t`.
 */
typedef struct olbvh_host_device {
  /*
   `vkGetInstanceProcAddr`, cast to this type.
   */
  void (*get_instance_proc_addr)(void);
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
   `VkQueue` of that family. Nobody else submits to it while a function runs that does work at once (`olbvh_gpu_from_host` with its self-test, uploads,
   builds, queries); those that record do not touch it. 0: recording is all that is done, untested.
   */
  uint64_t queue;
  /*
   `VkPipelineCache` of the host's, which knows the kernels of earlier runs. 0: one that lasts as long as the `olbvh_gpu`.
   */
  uint64_t pipeline_cache;
  /*
   Queue family with compute; it needs nothing else.
   */
  uint32_t queue_family;
  /*
   Not 0: the feature `bufferDeviceAddress` is enabled.
   */
  uint32_t buffer_addresses;
  /*
   Not 0: feature `shaderInt64` is enabled, which only drivers for processors profit from.
   */
  uint32_t shader_int64;
  /*
   Not 0: `VK_EXT_subgroup_size_control` (or Vulkan 1.3) is enabled with `subgroupSizeControl` and `computeFullSubgroups`. Wanted where subgroup sizes
   vary: without it the driver is trusted to run kernels with its usual size, which the self-test at the opening checks; Intel's are not.
   */
  uint32_t subgroup_size_control;
  /*
   Not 0: the instance extension `VK_EXT_debug_utils` is enabled.
   */
  uint32_t debug_utils;
} olbvh_host_device;

/*
 What a picture shows; `olbvh_default_picture_settings` fills it.
 */
typedef struct olbvh_picture_settings {
  /*
   Pixels in a row.
   */
  uint32_t width;
  /*
   Rows.
   */
  uint32_t height;
  /*
   The camera, as `olbvh render --camera` takes it; null: it sees the whole mesh from an angle.
   */
  const char *camera;
  /*
   Name of a colour map, as `olbvh render --tf` takes it; null: the usual one.
   */
  const char *colors;
  /*
   Opacity, as `olbvh render --opacity` takes it; null: `olbvh_render` makes it fit the field, `olbvh_view_make` lets it rise with the value.
   */
  const char *opacity;
  /*
   Values of iso-surfaces, which are drawn instead of the volume.
   */
  float iso[8];
  /*
   How many of them there are; 0: the volume is drawn.
   */
  uint32_t iso_count;
  /*
   Values at the ends of the colour map; the first above the second: all values that the field has.
   */
  float range[2];
  /*
   Distance of two samples in units of the mesh; 0: 1/512 of its diagonal.
   */
  double step;
  /*
   Factor on the opacity: 2 is as opaque as twice the way through the mesh.
   */
  float opacity_scale;
  /*
   A ray ends once it is this opaque.
   */
  float termination;
  /*
   Not 0: surface and steep values are lit.
   */
  uint32_t shading;
  /*
   Opacity that a lit surface seen from the side has at least.
   */
  float outline;
  /*
   Direction to the light: right, up, towards the viewer.
   */
  float light[3];
} olbvh_picture_settings;

/*
 Where the voxels of a stack of layers lie.
 */
typedef struct olbvh_voxels {
  /*
   Centre of voxel (0, 0) of layer 0.
   */
  float origin[3];
  /*
   From one voxel to the next in a row.
   */
  float across[3];
  /*
   From one row to the next.
   */
  float down[3];
  /*
   From one layer to the next.
   */
  float up[3];
  /*
   Half axes of a voxel's box.
   */
  float half[3][3];
  /*
   Voxels in a row.
   */
  uint32_t width;
  /*
   Rows of a layer.
   */
  uint32_t height;
  /*
   Layers.
   */
  uint32_t layers;
} olbvh_voxels;

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
   How to build. Without a capacity there is room for 8 entries per tetrahedron (24 where all are listed), or for what the budget allows; trees that need more
   get coarser.
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
   `VkBufferUsageFlags` of every buffer, with buffer addresses `VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT` among them.
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
   0: each point by itself. 1: each around the owner of the one before, for more points than half the tetrahedra, of which each lies near the one
   before. 2: so too, for points in no order, which are sorted first.
   */
  uint32_t path;
  /*
   For path 0, if not of no bytes: a word per point, a valid tetrahedron to begin with, such as the owner of the frame before, or 0xffffffff.
   */
  struct olbvh_buffer hints;
  /*
   For path 2: memory to sort in, of `olbvh_location_parts`.
   */
  struct olbvh_buffer memory;
  /*
   A word per point: its owner, or 0xffffffff.
   */
  struct olbvh_buffer owners;
  /*
   Four floats per point, in the order of the cell's vertices; zeroes without an owner.
   */
  struct olbvh_buffer barycentrics;
} olbvh_location;

/*
 What memory location takes.
 */
typedef struct olbvh_location_parts_data {
  /*
   Bytes of `olbvh_location.memory`: 0 but for path 2.
   */
  uint64_t bytes;
} olbvh_location_parts_data;

/*
 Memory of all owners of points, and where in it the answers are.
 */
typedef struct olbvh_owner_parts_data {
  /*
   Bytes of the memory.
   */
  uint64_t bytes;
  /*
   A word per point: the lowest of its owners, as location gives it.
   */
  struct olbvh_buffer owners;
  /*
   Four floats per point: coordinates in that one.
   */
  struct olbvh_buffer barycentrics;
  /*
   A word per point: where its owners end in the list; they begin where those of the point before end, the first at 0.
   */
  struct olbvh_buffer ends;
  /*
   A word: how many owners all points have together, whether or not there was room for them.
   */
  struct olbvh_buffer total;
} olbvh_owner_parts_data;

/*
 Values on a mesh.
 */
typedef struct olbvh_field {
  /*
   A 32-bit float per point, or per tetrahedron.
   */
  struct olbvh_buffer values;
  /*
   0: per point, linear in a tetrahedron. Else: per tetrahedron.
   */
  uint32_t on_cells;
} olbvh_field;

/*
 What a picture shows, for the device: `olbvh_view_make` fills it, and the host copies it as it is to where `olbvh_picture.view` lies.
 */
typedef struct olbvh_view {
  /*
   Rays, light, step, range of values, iso-surfaces.
   */
  uint32_t frame[64];
  /*
   The transfer function over the range of values: colour, and opacity of one step or of one surface.
   */
  float table[1024][4];
  /*
   Ranges of values outside of which nothing is to be seen, ascending and apart; behind the last stand such as no value lies in.
   */
  float drawn[512][2];
  /*
   How many of them there are.
   */
  uint32_t drawn_count;
} olbvh_view;

/*
 How far a recording goes with work that takes as many dispatches as it takes: a dispatch looks at so much and no more, so that no device is kept
 busy for long. The status of the query says what is left.
 */
typedef struct olbvh_rounds {
  /*
   Dispatches, one after the other; what is finished is passed over.
   */
  uint32_t count;
  /*
   Not 0: go on where an earlier recording of the same ended.
   */
  uint32_t resume;
} olbvh_rounds;

/*
 What is drawn, and where. Contents are read when the commands are executed, so a new view or new values need no new recording.
 */
typedef struct olbvh_picture {
  /*
   Pixels in a row.
   */
  uint32_t width;
  /*
   Rows.
   */
  uint32_t height;
  /*
   Not 0: the iso-surfaces that the view has, instead of the volume.
   */
  uint32_t iso;
  /*
   With ranges: ranges of the view that are looked at, its `drawn_count` or more, up to 512.
   */
  uint32_t drawn_count;
  /*
   An `olbvh_view`.
   */
  struct olbvh_buffer view;
  /*
   What is shown.
   */
  struct olbvh_field field;
  /*
   Three floats per point of the mesh, normals of length up to 1 by which the volume is lit. Of no bytes: it is not lit.
   */
  struct olbvh_buffer normals;
  /*
   The ranges of the field that `olbvh_cmd_ranges` records: nodes without a value to be seen are skipped. Of no bytes: nothing is. The picture is the same.
   */
  struct olbvh_buffer ranges;
  /*
   Memory of `olbvh_picture_parts`.
   */
  struct olbvh_buffer memory;
  /*
   A round takes up to 1,024 samples of every ray. No round, from the beginning, prepares the picture and leaves it empty.
   */
  struct olbvh_rounds rounds;
} olbvh_picture;

/*
 Memory of a picture, and where in it the answers are.
 */
typedef struct olbvh_picture_parts_data {
  /*
   Bytes of the memory.
   */
  uint64_t bytes;
  /*
   Per pixel, the upper row first, four floats: colour, multiplied by its opacity, and opacity.
   */
  struct olbvh_buffer colors;
  /*
   Words: samples taken, those in the mesh, those skipped, two words each, the lower first; then rays that need another round.
   */
  struct olbvh_buffer status;
} olbvh_picture_parts_data;

/*
 Which voxels are sliced, and where the answers go.
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
   Number of that row in its layer.
   */
  uint32_t first;
  /*
   Rows; behind the last of a layer comes the first of the next. In whole layers, or parts of one that begin at multiples of 64 rows, voxels have the same
   owners as in the whole stack where cells overlap, too.
   */
  uint32_t rows;
  /*
   As `olbvh_slice` takes it.
   */
  uint32_t linear;
  /*
   The field, or one whose values are of no bytes: none.
   */
  struct olbvh_field field;
  /*
   Memory of `olbvh_slicing_parts`.
   */
  struct olbvh_buffer memory;
  /*
   One is enough but where leaves hold thousands of tetrahedra.
   */
  struct olbvh_rounds rounds;
} olbvh_slicing;

/*
 Memory of a slice, and where in it the answers are.
 */
typedef struct olbvh_slicing_parts_data {
  /*
   Bytes of the memory: 29 per voxel, and 32 per run of 64 voxels below each other in a layer.
   */
  uint64_t bytes;
  /*
   A word per voxel, row by row, as `olbvh_slice` gives it.
   */
  struct olbvh_buffer answers;
  /*
   A float per voxel: the value, NaN where it is empty; not written without a field.
   */
  struct olbvh_buffer values;
  /*
   Words: runs of voxels and voxels that need another round, and until there are none nothing else is to be used; why all are empty (1: the boxes are flat,
   2: they are more than twice as large as the mesh), or 0; voxels with their centre in the mesh, those that it merely touches, those that it does not.
   */
  struct olbvh_buffer status;
} olbvh_slicing_parts_data;

/*
 Memory of the overlap of two meshes, and where in it the answers are.
 */
typedef struct olbvh_overlap_parts_data {
  /*
   Bytes of the memory.
   */
  uint64_t bytes;
  /*
   For A and for B a bit per tetrahedron, the lowest of a word first: it intersects the other mesh.
   */
  struct olbvh_buffer hits[2];
  /*
   For A and for B; the fifth word of either counts the tetrahedra that need another round, whose bits are 0.
   */
  struct olbvh_buffer status[2];
} olbvh_overlap_parts_data;

/*
 Memory of the pairs of two meshes, and where in it the answers are.
 */
typedef struct olbvh_pair_parts_data {
  /*
   Bytes of the memory.
   */
  uint64_t bytes;
  /*
   Words 4 and 5: tetrahedra of A that need another round to be counted, and to have their pairs written. Words 8 and 9: pairs, the lower first.
   */
  struct olbvh_buffer status;
} olbvh_pair_parts_data;

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
 Brings a mesh to the device: three floats per point, four indices per tetrahedron. Bad cells are left out and counted. `reorder`, if not 0, brings points
 and tetrahedra into the order of a Z curve on the way, which pays where they come in no order; all functions go on to take and to give the caller's numbers.
 Of the tetrahedra that share a face, edge or vertex, the first along the curve owns its points then, not that of the lowest number.
 */
enum olbvh_status olbvh_mesh_upload(const struct olbvh_gpu *gpu,
                                    const float *points,
                                    size_t point_count,
                                    const uint32_t *tets,
                                    size_t tet_count,
                                    uint32_t reorder,
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
 Tells what to enable on a physical device before a device is made from it. Handles are cast to `uint64_t`, `vkGetInstanceProcAddr` to a function without
 arguments. Ends with `OLBVH_STATUS_DEVICE` where the device does not qualify; `olbvh_last_error` tells what it lacks.
 */
enum olbvh_status olbvh_host_check(void (*get_instance_proc_addr)(void),
                                   uint64_t instance,
                                   uint64_t physical_device,
                                   struct olbvh_host_requirements *out);

/*
 Works on a device of the host's, which outlives everything made from the handle. Buffers are used by queues of that family alone, with exclusive sharing: a
 host that reads or writes them on another family transfers their ownership.
 */
enum olbvh_status olbvh_gpu_from_host(const struct olbvh_host_device *host,
                                      struct olbvh_gpu **out);

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
 What pictures are like where nothing else is asked for.
 */
struct olbvh_picture_settings olbvh_default_picture_settings(void);

/*
 Draws a field: `values` has a float per point, or per tetrahedron if `on_cells` is not 0. `pixels` gets four floats per pixel, the upper row first: colour
 (sRGB from 0 to 1) multiplied by its opacity, and opacity; what is behind is the caller's.
 */
enum olbvh_status olbvh_render(const struct olbvh_tree *tree,
                               const struct olbvh_picture_settings *settings,
                               const float *values,
                               uint32_t on_cells,
                               float *pixels);

/*
 Slices a mesh conservatively: no voxel that it touches is left empty. `answers`, if not null, gets a word per voxel, layer by layer and row by row: the
 tetrahedron of its centre; plus 2^31 the nearest that touches its box, if the centre lies in none; 0xffffffff if it is empty. `results`, if not null, gets a
 float: the value of the field (`values` and `on_cells` as `olbvh_render` takes them) there, NaN where it is empty. A voxel that is merely touched gets the
 value of the tetrahedron's nearest point or, if `linear` is not 0, its field continued to the centre.
 */
enum olbvh_status olbvh_slice(const struct olbvh_tree *tree,
                              const struct olbvh_voxels *voxels,
                              const float *values,
                              uint32_t on_cells,
                              uint32_t linear,
                              uint32_t *answers,
                              float *results);

/*
 Finds the tetrahedra of either mesh that intersect the other, whose points lie in one space. Of `hits_a` and `hits_b` word i / 32 gets bit i % 32
 set if tetrahedron i does; both have a word for 32 tetrahedra, the last of them perhaps for fewer. The trees are of one `olbvh_gpu`.
 */
enum olbvh_status olbvh_overlap(const struct olbvh_tree *a,
                                const struct olbvh_tree *b,
                                uint32_t *hits_a,
                                uint32_t *hits_b);

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
 Says that the host recorded a barrier of its own instead of `olbvh_cmd_barrier`, which does as much or more: the end misses none there. Records nothing.
 */
enum olbvh_status olbvh_recording_host_barrier(struct olbvh_recording *recording);

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
 Records the construction of a scene's tree for the positions there are then. Reads positions and cells in compute shaders, uses memory and scratch in
 compute shaders and transfers, and ends with a barrier as `olbvh_cmd_barrier` records it.
 */
enum olbvh_status olbvh_cmd_build(struct olbvh_recording *recording,
                                  const struct olbvh_scene *scene);

/*
 Tells what memory the location takes besides the answers.
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
 Tells what memory all owners of the points take, and where in `memory` (of no bytes, as long as there is none) the answers are.
 */
enum olbvh_status olbvh_owner_parts(const struct olbvh_scene *scene,
                                    const struct olbvh_location *location,
                                    struct olbvh_buffer memory,
                                    struct olbvh_owner_parts_data *out);

/*
 Records all owners of points: the tetrahedra that contain each, ascending, point by point, a word each in `found`. As many are written as that
 holds; `ends` and `total` of `olbvh_owner_parts` are right in any case. Of the location, points, stride, count and tolerance are read.
 */
enum olbvh_status olbvh_cmd_owners(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_location *location,
                                   struct olbvh_buffer memory,
                                   struct olbvh_buffer found);

/*
 Records the values of a field at points that have been located: a float each in `values`, NaN without an owner. Of the location, count, owners and
 barycentrics are read, by compute shaders.
 */
enum olbvh_status olbvh_cmd_interpolate(struct olbvh_recording *recording,
                                        const struct olbvh_scene *scene,
                                        const struct olbvh_location *location,
                                        const struct olbvh_field *field,
                                        struct olbvh_buffer values);

/*
 Works out what a picture shows of a mesh whose points lie within the box from `lo` to `hi`, three floats each: the camera is placed by it, and lengths are
 measured by its diagonal. Without a range in the settings, values reach from 0 to 1.
 */
enum olbvh_status olbvh_view_make(const struct olbvh_picture_settings *settings,
                                  const float *lo,
                                  const float *hi,
                                  struct olbvh_view *out);

/*
 Tells how many bytes the ranges of a field take.
 */
enum olbvh_status olbvh_range_bytes(const struct olbvh_scene *scene, uint64_t *out);

/*
 Records the smallest and the largest value of a field in every node of the tree into `ranges`; new values need this alone, not a new tree. Begins with a
 transfer write, ends with a barrier as `olbvh_cmd_barrier` records it.
 */
enum olbvh_status olbvh_cmd_ranges(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_field *field,
                                   struct olbvh_buffer ranges);

/*
 Tells what memory a picture takes, and where in its `memory` (of no bytes, as long as there is none) the answers are.
 */
enum olbvh_status olbvh_picture_parts(const struct olbvh_scene *scene,
                                      const struct olbvh_picture *picture,
                                      struct olbvh_picture_parts_data *out);

/*
 Records the drawing of a picture. Where nodes are skipped, the tree is read by transfers as well.
 */
enum olbvh_status olbvh_cmd_render(struct olbvh_recording *recording,
                                   const struct olbvh_scene *scene,
                                   const struct olbvh_picture *picture);

/*
 Tells what memory a slice takes, and where in its `memory` (of no bytes, as long as there is none) the answers are.
 */
enum olbvh_status olbvh_slicing_parts(const struct olbvh_slicing *slicing,
                                      struct olbvh_slicing_parts_data *out);

/*
 Records the slicing of rows of voxels. The status is written by transfers as well.
 */
enum olbvh_status olbvh_cmd_slice(struct olbvh_recording *recording,
                                  const struct olbvh_scene *scene,
                                  const struct olbvh_slicing *slicing);

/*
 Tells what memory the overlap of two meshes takes, and where in `memory` (of no bytes, as long as there is none) the answers are.
 */
enum olbvh_status olbvh_overlap_parts(const struct olbvh_scene *a,
                                      const struct olbvh_scene *b,
                                      struct olbvh_buffer memory,
                                      struct olbvh_overlap_parts_data *out);

/*
 Records which tetrahedra of A intersect B and which of B intersect A; the points of both lie in one space. Three rounds are enough for most.
 */
enum olbvh_status olbvh_cmd_overlap(struct olbvh_recording *recording,
                                    const struct olbvh_scene *a,
                                    const struct olbvh_scene *b,
                                    struct olbvh_buffer memory,
                                    struct olbvh_rounds rounds);

/*
 Tells what memory the pairs of A with another mesh take, and where in `memory` (of no bytes, as long as there is none) the status is.
 */
enum olbvh_status olbvh_pair_parts(const struct olbvh_scene *a,
                                   struct olbvh_buffer memory,
                                   struct olbvh_pair_parts_data *out);

/*
 Records how many pairs of a tetrahedron of A and one of B touch; the tree over B has all lists (`lists` 0). But for `assign` 0, a pair counts once per
 leaf that lists both.
 */
enum olbvh_status olbvh_cmd_count_pairs(struct olbvh_recording *recording,
                                        const struct olbvh_scene *a,
                                        const struct olbvh_scene *b,
                                        struct olbvh_buffer memory,
                                        struct olbvh_rounds rounds);

/*
 Records the pairs themselves, once they are counted: two words each in `found`, the tetrahedron of A and that of B, ascending by A. As many are written
 as that holds. Begins with a barrier; if it goes on where an earlier recording ended, with a transfer write of the status.
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
