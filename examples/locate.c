/* Locates the points of a grid of 6 n^3 tetrahedra, and prints the owner of each, one per line: those that
 * `olbvh locate kuhn:N,N,N` finds.
 *
 *     cc examples/locate.c -Iinclude -Ltarget/release -lolbvh -o locate && ./locate 4
 */
#include "grid.h"

int main(int argc, char **argv) {
    grid mesh_data = make_grid(argc > 1 ? (uint32_t)atoi(argv[1]) : 4);
    size_t points = mesh_data.points;
    uint32_t *owners = malloc(points * sizeof *owners);
    if (!owners) return 1;

    olbvh_gpu *gpu = NULL;
    olbvh_mesh *mesh = NULL;
    olbvh_tree *tree = NULL;
    check(olbvh_gpu_open(NULL, &gpu), "opening a device");
    check(olbvh_mesh_upload(gpu, mesh_data.place, points, mesh_data.cells, mesh_data.tets, 0, &mesh), "uploading the mesh");
    olbvh_build_options options = olbvh_default_build_options();
    options.budget = 1;
    if (olbvh_tree_build(mesh, &options, &tree) != OLBVH_STATUS_TOO_LARGE) return 1;
    fprintf(stderr, "as it should be: %s\n", olbvh_last_error());
    check(olbvh_tree_build(mesh, NULL, &tree), "building the tree");
    /* A handle keeps alive what it was made from. */
    olbvh_mesh_free(mesh);
    olbvh_gpu_free(gpu);
    olbvh_tree_info_data info;
    check(olbvh_tree_info(tree, &info), "asking the tree");
    fprintf(stderr, "olbvh %s: level %u, %u entries\n", olbvh_version(), info.level, info.entries);
    check(olbvh_locate(tree, mesh_data.place, points, -1.0f, owners, NULL), "locating points");
    for (size_t i = 0; i < points; ++i) printf("%u\n", owners[i]);
    if (olbvh_locate(NULL, mesh_data.place, points, -1.0f, owners, NULL) != OLBVH_STATUS_INVALID) return 1;
    fprintf(stderr, "as it should be: %s\n", olbvh_last_error());
    olbvh_tree_free(tree);
    free(mesh_data.place), free(mesh_data.cells), free(owners);
    return 0;
}
