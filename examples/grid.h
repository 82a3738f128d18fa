/* What the C examples share: a grid of 6 n^3 tetrahedra, equal to `kuhn:N,N,N`, and a check of the status of calls. */
#include "olbvh.h"
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    uint32_t points, tets;
    float *place;    /* three floats per point */
    uint32_t *cells; /* four points per tetrahedron */
} grid;

static void check(olbvh_status status, const char *what) {
    if (status == OLBVH_STATUS_OK) return;
    fprintf(stderr, "%s: %s\n", what, olbvh_last_error());
    exit(1);
}

/* Six tetrahedra per unit cell: the corners along each of the six paths from its lower to its upper corner. */
static grid make_grid(uint32_t n) {
    static const int paths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    uint32_t side = n + 1;
    grid made = {.points = side * side * side, .tets = 6 * n * n * n};
    made.place = malloc(3 * sizeof(float) * made.points);
    made.cells = malloc(4 * sizeof(uint32_t) * made.tets);
    if (n == 0 || !made.place || !made.cells) exit(1);
    for (uint32_t i = 0; i < made.points; ++i) {
        made.place[3 * i] = (float)(i % side);
        made.place[3 * i + 1] = (float)(i / side % side);
        made.place[3 * i + 2] = (float)(i / side / side);
    }
    size_t k = 0;
    for (uint32_t z = 0; z < n; ++z)
        for (uint32_t y = 0; y < n; ++y)
            for (uint32_t x = 0; x < n; ++x)
                for (int path = 0; path < 6; ++path) {
                    uint32_t at[3] = {x, y, z};
                    for (int step = 0; step < 4; ++step) {
                        made.cells[k++] = (at[2] * side + at[1]) * side + at[0];
                        if (step < 3) ++at[paths[path][step]];
                    }
                }
    return made;
}
