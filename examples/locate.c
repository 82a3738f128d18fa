/* Finds the cells of points in a grid of 6 n^3 tetrahedra, the same that `olbvh locate kuhn:N,N,N` finds. Prints a line per point.
 *
 *     cc examples/locate.c -Iinclude -Ltarget/release -lolbvh -o locate && ./locate 4
 */
#include "olbvh.h"
#include <stdio.h>
#include <stdlib.h>

static void check(olbvh_status status, const char *what) {
    if (status == OLBVH_STATUS_OK) return;
    fprintf(stderr, "%s: %s\n", what, olbvh_last_error());
    exit(1);
}

/* What a renderer does before its first frame: asks how much memory it has to lend, and rehearses what it will record into its command buffers, so that
 * nothing is made then. A rehearsal never touches the buffers. A frame is the same with a VkCommandBuffer; `olbvh_gpu_from_host` takes its VkDevice. */
static void rehearse(uint32_t points, uint32_t tets) {
    olbvh_gpu *gpu = NULL;
    olbvh_scene *scene = NULL;
    olbvh_recording *recording = NULL;
    check(olbvh_gpu_open(NULL, &gpu), "opening a device");
    olbvh_plan plan = {.points = points, .stride = 3, .tets = tets, .level = 7, .build = olbvh_default_build_options()};
    olbvh_plan_sizes sizes;
    check(olbvh_plan_measure(gpu, &plan, &sizes), "measuring");
    fprintf(stderr, "%llu bytes for mesh and tree, %llu while building\n", (unsigned long long)sizes.memory, (unsigned long long)sizes.scratch);
    olbvh_buffer positions = {.buffer = 1, .size = 12ull * points}, cells = {.buffer = 2, .size = 16ull * tets};
    olbvh_buffer memory = {.buffer = 3, .size = sizes.memory}, scratch = {.buffer = 4, .size = sizes.scratch};
    check(olbvh_scene_place(gpu, &plan, positions, cells, memory, scratch, &scene), "placing");
    olbvh_location location = {.points = positions, .stride = 3, .count = points, .tolerance = -1.0f};
    location.owners = (olbvh_buffer){.buffer = 5, .size = 4ull * points};
    location.barycentrics = (olbvh_buffer){.buffer = 6, .size = 16ull * points};
    check(olbvh_recording_new(gpu, &recording), "making a recording");
    check(olbvh_recording_begin(recording, 0, 0, 0), "beginning a rehearsal");
    check(olbvh_cmd_build(recording, scene), "recording the tree");
    check(olbvh_cmd_locate(recording, scene, &location), "recording location");
    check(olbvh_recording_end(recording), "rehearsing");
    olbvh_recording_free(recording);
    olbvh_scene_free(scene);
    olbvh_gpu_free(gpu);
}

int main(int argc, char **argv) {
    /* The corners of each unit cell along the six paths from its lower to its upper corner. */
    static const int paths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    uint32_t n = argc > 1 ? (uint32_t)atoi(argv[1]) : 4, side = n + 1;
    size_t points = (size_t)side * side * side, tets = 6 * (size_t)n * n * n, k = 0, i;
    float *place = malloc(3 * points * sizeof *place);
    uint32_t *cells = malloc(4 * tets * sizeof *cells), *owners = malloc(points * sizeof *owners);
    if (n == 0 || !place || !cells || !owners) return 1;
    for (i = 0; i < points; ++i) {
        place[3 * i] = (float)(i % side);
        place[3 * i + 1] = (float)(i / side % side);
        place[3 * i + 2] = (float)(i / side / side);
    }
    for (uint32_t z = 0; z < n; ++z)
        for (uint32_t y = 0; y < n; ++y)
            for (uint32_t x = 0; x < n; ++x)
                for (int path = 0; path < 6; ++path) {
                    uint32_t at[3] = {x, y, z};
                    for (int step = 0; step < 4; ++step) {
                        cells[k++] = (at[2] * side + at[1]) * side + at[0];
                        if (step < 3) ++at[paths[path][step]];
                    }
                }

    olbvh_gpu *gpu = NULL;
    olbvh_mesh *mesh = NULL;
    olbvh_tree *tree = NULL;
    check(olbvh_gpu_open(NULL, &gpu), "opening a device");
    check(olbvh_mesh_upload(gpu, place, points, cells, tets, &mesh), "uploading the mesh");
    olbvh_build_options options = olbvh_default_build_options();
    options.budget = 1;
    if (olbvh_tree_build(mesh, &options, &tree) != OLBVH_STATUS_TOO_LARGE) return 1;
    fprintf(stderr, "as it should be: %s\n", olbvh_last_error());
    check(olbvh_tree_build(mesh, NULL, &tree), "building the tree");
    /* Handles keep what they were made from. */
    olbvh_mesh_free(mesh);
    olbvh_gpu_free(gpu);
    olbvh_tree_info_data info;
    check(olbvh_tree_info(tree, &info), "asking the tree");
    fprintf(stderr, "olbvh %s: level %u, %u entries\n", olbvh_version(), info.level, info.entries);
    check(olbvh_locate(tree, place, points, -1.0f, owners, NULL), "locating points");
    for (i = 0; i < points; ++i) printf("%u\n", owners[i]);
    if (olbvh_locate(NULL, place, points, -1.0f, owners, NULL) != OLBVH_STATUS_INVALID) return 1;
    fprintf(stderr, "as it should be: %s\n", olbvh_last_error());
    olbvh_tree_free(tree);
    rehearse((uint32_t)points, (uint32_t)tets);
    free(place), free(cells), free(owners);
    return 0;
}
