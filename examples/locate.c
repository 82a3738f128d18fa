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
    free(place), free(cells), free(owners);
    return 0;
}
