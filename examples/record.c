/* A program with its own Vulkan device, on a queue family with compute. It records a tree, the ranges of a field, a
 * picture and a slice into its own command buffer and memory, submits once, and compares picture and slice with those
 * of the owning calls.
 *
 *     cc examples/record.c -Iinclude -Ltarget/release -lolbvh -lvulkan -o record && ./record 4
 */
#include "grid.h"
#include <string.h>
#include <vulkan/vulkan.h>

enum { WIDTH = 96, HEIGHT = 72, LAYER = 40, LAYERS = 3 };

static VkPhysicalDevice physical;
static VkDevice device;

static void vk(VkResult result, const char *what) {
    if (result == VK_SUCCESS) return;
    fprintf(stderr, "%s: VkResult %d\n", what, (int)result);
    exit(1);
}

/* A buffer that the processor can access as well, which keeps this program short. A renderer would have its memory
 * where the device is fastest. */
static olbvh_buffer make_buffer(uint64_t bytes, VkBufferUsageFlags usage, void **mapped) {
    VkBufferCreateInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = bytes};
    info.usage = usage | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    VkBuffer buffer;
    vk(vkCreateBuffer(device, &info, NULL, &buffer), "vkCreateBuffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, buffer, &needs);
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    VkMemoryPropertyFlags wanted = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    uint32_t type = 0;
    while (!(needs.memoryTypeBits >> type & 1) || (memory.memoryTypes[type].propertyFlags & wanted) != wanted) ++type;
    VkMemoryAllocateFlagsInfo flags = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, .flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT};
    VkMemoryAllocateInfo allocation = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .pNext = &flags};
    allocation.allocationSize = needs.size;
    allocation.memoryTypeIndex = type;
    VkDeviceMemory held;
    vk(vkAllocateMemory(device, &allocation, NULL, &held), "vkAllocateMemory");
    vk(vkBindBufferMemory(device, buffer, held, 0), "vkBindBufferMemory");
    vk(vkMapMemory(device, held, 0, VK_WHOLE_SIZE, 0, mapped), "vkMapMemory");
    VkBufferDeviceAddressInfo of = {.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, .buffer = buffer};
    /* Buffers live as long as the process: nothing is destroyed here. */
    return (olbvh_buffer){.buffer = (uint64_t)(uintptr_t)buffer, .size = bytes, .address = vkGetBufferDeviceAddress(device, &of)};
}

static olbvh_buffer upload(const void *data, uint64_t bytes, VkBufferUsageFlags usage) {
    void *mapped;
    olbvh_buffer buffer = make_buffer(bytes, usage, &mapped);
    memcpy(mapped, data, bytes);
    return buffer;
}

int main(int argc, char **argv) {
    uint32_t n = argc > 1 ? (uint32_t)atoi(argv[1]) : 4;
    grid mesh_data = make_grid(n);
    float *values = malloc(mesh_data.points * sizeof *values);
    if (!values) return 1;
    for (uint32_t i = 0; i < mesh_data.points; ++i) values[i] = mesh_data.place[3 * i] + mesh_data.place[3 * i + 2];

    /* The program's own Vulkan device. */
    VkApplicationInfo application = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_2};
    VkInstanceCreateInfo instance_info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &application};
    VkInstance instance;
    vk(vkCreateInstance(&instance_info, NULL, &instance), "vkCreateInstance");
    uint32_t one = 1;
    if (vkEnumeratePhysicalDevices(instance, &one, &physical) < 0 || one == 0) return 1;
    olbvh_host_device host = {.get_instance_proc_addr = (void (*)(void))vkGetInstanceProcAddr, .instance = (uint64_t)(uintptr_t)instance};
    host.physical_device = (uint64_t)(uintptr_t)physical;
    olbvh_host_requirements needs;
    check(olbvh_host_check(host.get_instance_proc_addr, host.instance, host.physical_device, &needs), "checking the device");
    float priority = 1.0f;
    VkDeviceQueueCreateInfo queues = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, .queueFamilyIndex = needs.queue_family, .queueCount = 1};
    queues.pQueuePriorities = &priority;
    VkPhysicalDeviceBufferDeviceAddressFeatures addresses = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES};
    /* This program uses buffers by address only; olbvh also works without addresses. */
    addresses.bufferDeviceAddress = VK_TRUE;
    VkPhysicalDeviceSubgroupSizeControlFeatures control = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_FEATURES};
    control.subgroupSizeControl = control.computeFullSubgroups = VK_TRUE;
    if (needs.subgroup_size_control) addresses.pNext = &control;
    VkPhysicalDeviceFeatures core = {.shaderInt64 = needs.shader_int64};
    VkDeviceCreateInfo device_info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, .pNext = &addresses, .pEnabledFeatures = &core};
    device_info.enabledExtensionCount = needs.extension_count;
    device_info.ppEnabledExtensionNames = needs.extensions;
    device_info.queueCreateInfoCount = 1;
    device_info.pQueueCreateInfos = &queues;
    vk(vkCreateDevice(physical, &device_info, NULL, &device), "vkCreateDevice");
    VkQueue queue;
    vkGetDeviceQueue(device, needs.queue_family, 0, &queue);
    VkCommandPoolCreateInfo pool_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, .queueFamilyIndex = needs.queue_family};
    VkCommandPool pool;
    vk(vkCreateCommandPool(device, &pool_info, NULL, &pool), "vkCreateCommandPool");
    VkCommandBufferAllocateInfo commands_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, .commandPool = pool};
    commands_info.commandBufferCount = 1;
    VkCommandBuffer commands;
    vk(vkAllocateCommandBuffers(device, &commands_info, &commands), "vkAllocateCommandBuffers");

    /* olbvh on that device. */
    host.device = (uint64_t)(uintptr_t)device;
    host.queue = (uint64_t)(uintptr_t)queue;
    host.queue_family = needs.queue_family;
    host.buffer_addresses = 1;
    host.shader_int64 = needs.shader_int64;
    host.subgroup_size_control = needs.subgroup_size_control;
    olbvh_gpu *gpu = NULL;
    check(olbvh_gpu_from_host(&host, &gpu), "lending the device");

    /* Sizes come first: those of mesh and tree. */
    olbvh_plan plan = {.points = mesh_data.points, .stride = 3, .tets = mesh_data.tets, .level = 7, .build = olbvh_default_build_options()};
    olbvh_plan_sizes sizes;
    check(olbvh_plan_measure(gpu, &plan, &sizes), "measuring");
    olbvh_buffer positions = upload(mesh_data.place, 12ull * mesh_data.points, sizes.usage);
    olbvh_buffer cells = upload(mesh_data.cells, 16ull * mesh_data.tets, sizes.usage);
    void *unused, *tree_bytes, *picture_bytes, *slice_bytes;
    olbvh_buffer memory = make_buffer(sizes.memory, sizes.usage, &tree_bytes), scratch = make_buffer(sizes.scratch, sizes.usage, &unused);
    olbvh_scene *scene = NULL;
    check(olbvh_scene_place(gpu, &plan, positions, cells, memory, scratch, &scene), "placing");

    /* A picture that shows only some values, so that parts of the tree are skipped. */
    char camera[96];
    snprintf(camera, sizeof camera, "eye=%u,%u,%u,target=%g,%g,%g", 4 * n, 3 * n, 2 * n, n / 2.0, n / 2.0, n / 2.0);
    olbvh_picture_settings settings = olbvh_default_picture_settings();
    settings.width = WIDTH, settings.height = HEIGHT, settings.shading = 0;
    settings.camera = camera, settings.opacity = "0:0,0.4:0,0.5:0.3,0.6:0,1:0";
    settings.range[0] = 0.0f, settings.range[1] = 2.0f * (float)n;
    float lo[3] = {0, 0, 0}, hi[3] = {(float)n, (float)n, (float)n};
    olbvh_view view;
    check(olbvh_view_make(&settings, lo, hi, &view), "making the view");
    olbvh_picture picture = {.width = WIDTH, .height = HEIGHT, .drawn_count = view.drawn_count, .rounds = {.count = 1}};
    picture.view = upload(&view, sizeof view, sizes.usage);
    picture.field.values = upload(values, sizeof(float) * mesh_data.points, sizes.usage);
    uint64_t range_bytes;
    check(olbvh_range_bytes(scene, &range_bytes), "measuring ranges");
    picture.ranges = make_buffer(range_bytes, sizes.usage, &unused);
    olbvh_picture_parts_data drawn;
    check(olbvh_picture_parts(scene, &picture, &drawn), "measuring a picture");
    picture.memory = make_buffer(drawn.bytes, sizes.usage, &picture_bytes);
    check(olbvh_picture_parts(scene, &picture, &drawn), "placing a picture");

    /* Three layers of voxels. */
    float side = (float)n / (LAYER - 4);
    olbvh_slicing slicing = {.rows = LAYER * LAYERS, .field = picture.field, .rounds = {.count = 1}};
    slicing.voxels = (olbvh_voxels){.width = LAYER, .height = LAYER, .layers = LAYERS, .next_layer = {0, 0, hi[2] / 2}};
    slicing.voxels.origin[0] = slicing.voxels.origin[1] = -1.6f * side;
    slicing.voxels.next_voxel[0] = slicing.voxels.next_row[1] = side;
    for (int c = 0; c < 3; ++c) slicing.voxels.half[c][c] = side / 2;
    olbvh_slicing_parts_data sliced;
    check(olbvh_slicing_parts(&slicing, &sliced), "measuring a slice");
    slicing.memory = make_buffer(sliced.bytes, sizes.usage, &slice_bytes);
    check(olbvh_slicing_parts(&slicing, &sliced), "placing a slice");

    /* The recording is rehearsed first, so that nothing is created when it is recorded into the command buffer. */
    olbvh_recording *recording = NULL;
    check(olbvh_recording_new(gpu, &recording), "making a recording");
    VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    vk(vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
    for (int rehearsal = 1; rehearsal >= 0; --rehearsal) {
        check(olbvh_recording_begin(recording, rehearsal ? 0 : (uint64_t)(uintptr_t)commands, 0, 0), "beginning");
        check(olbvh_cmd_build(recording, scene), "recording the tree"); /* for moved points, later: olbvh_cmd_rebuild */
        check(olbvh_cmd_ranges(recording, scene, &picture.field, picture.ranges), "recording ranges");
        check(olbvh_cmd_render(recording, scene, &picture), "recording a picture");
        check(olbvh_cmd_slice(recording, scene, &slicing), "recording a slice");
        check(olbvh_recording_end(recording), "ending");
    }
    VkMemoryBarrier barrier = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    VkPipelineStageFlags writers = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    vkCmdPipelineBarrier(commands, writers, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0, NULL, 0, NULL);
    vk(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
    VkSubmitInfo submission = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1, .pCommandBuffers = &commands};
    vk(vkQueueSubmit(queue, 1, &submission, VK_NULL_HANDLE), "vkQueueSubmit");
    vk(vkQueueWaitIdle(queue), "vkQueueWaitIdle");

    /* What became of the mesh and its tree; a renderer would copy both to memory that it can read. */
    olbvh_scene_arrays_data arrays;
    check(olbvh_scene_arrays(scene, NULL, &arrays), "asking for arrays");
    const olbvh_build_status *built = (const olbvh_build_status *)((const char *)tree_bytes + arrays.status.offset);
    const olbvh_mesh_status *seen = (const olbvh_mesh_status *)((const char *)tree_bytes + arrays.mesh_status.offset);
    printf("tree: level %u, %u entries; %u bad tetrahedra\n", built->level, built->entries, seen->bad);
    if (built->overflow || built->level != built->wanted_level || seen->overflow || seen->bad || !seen->boundary) return 1;

    /* The same results from the owning calls. */
    olbvh_mesh *mesh = NULL;
    olbvh_tree *tree = NULL;
    check(olbvh_mesh_upload(gpu, mesh_data.place, mesh_data.points, mesh_data.cells, mesh_data.tets, 0, &mesh), "uploading the mesh");
    check(olbvh_tree_build(mesh, NULL, &tree), "building the tree");
    static float pixels[4 * WIDTH * HEIGHT], results[LAYER * LAYER * LAYERS];
    static uint32_t answers[LAYER * LAYER * LAYERS];
    check(olbvh_render(tree, &settings, values, 0, pixels), "drawing");
    check(olbvh_slice(tree, &slicing.voxels, values, 0, 0, answers, results), "slicing");
    const olbvh_picture_status *counted = (const olbvh_picture_status *)((const char *)picture_bytes + drawn.status.offset);
    const olbvh_slice_status *kinds = (const olbvh_slice_status *)((const char *)slice_bytes + sliced.status.offset);
    int same_picture = !memcmp((char *)picture_bytes + drawn.colors.offset, pixels, sizeof pixels);
    int same_slice = !memcmp((char *)slice_bytes + sliced.answers.offset, answers, sizeof answers)
                     && !memcmp((char *)slice_bytes + sliced.values.offset, results, sizeof results);
    printf("picture: %u samples in the mesh, %u skipped, %u rays left: %s\n", counted->found[0], counted->skipped[0], counted->unfinished,
           same_picture ? "the same" : "ANOTHER");
    printf("slice: %u voxels inside, %u touched, %u empty: %s\n", kinds->inside, kinds->touched, kinds->empty,
           same_slice ? "the same" : "ANOTHER");
    olbvh_tree_free(tree);
    olbvh_mesh_free(mesh);
    olbvh_recording_free(recording);
    olbvh_scene_free(scene);
    olbvh_gpu_free(gpu);
    int finished = !counted->unfinished && !kinds->locating && !kinds->touching;
    return !(same_picture && same_slice && finished && counted->found[0] && kinds->inside && kinds->touched);
}
