/* lambert bench lowrank: the low-rank family at the sizes of both papers. */
#include "solver/bench/lowrank.h"

enum { ROOMS_MOST = 4 };

lam_status bench_lowrank(const bench_run *run, lam_error *error) {
    /* 640 and 2,560 elements; 2,560 and 10,240; all of the thesis'. */
    static const size_t divisions[3][ROOMS_MOST] = {{8, 16, 0, 0}, {16, 32, 0, 0}, {16, 32, 64, 128}};
    lam_status status = LAM_OK;
    lowrank_scene rooms[ROOMS_MOST] = {{.name = NULL}};
    const lowrank_scene *all[ROOMS_MOST];
    size_t n = 0;
    for (; n < ROOMS_MOST && divisions[run->scale][n] > 0; n++) {
        TRY(lowrank_room(run, divisions[run->scale][n], &rooms[n], error));
        all[n] = &rooms[n];
    }
    const lowrank_scene *first = all[0];
    const size_t small = run->scale == BENCH_QUICK ? 1 : 2;
    TRY(lowrank_of_alpha(run, first, error));
    TRY(lowrank_of_compression(run, first, error));
    TRY(lowrank_of_levels(run, all, small, error));
    TRY(lowrank_of_order(run, all, n, error));
    TRY(lowrank_of_factorizers(run, all, n < 3 ? n : 3, error));
    TRY(lowrank_of_rank(run, all, n, error));
    TRY(lowrank_of_radiosity(run, error));
    TRY(lowrank_of_methods(run, error));
    TRY(lowrank_of_index_vector(run, error));
done:
    for (size_t k = 0; k < ROOMS_MOST; k++) lowrank_scene_free(&rooms[k]);
    return status;
}
