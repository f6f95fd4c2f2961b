#include "solver/scene/generate/scene_draft.h"
#include "solver/scene/face_grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void draft_free(draft *d) {
    point_table_free(&d->points);
    free(d->faces);
    free(d->groups);
    *d = (draft){0};
}

lam_status draft_group(draft *d, const char *name, const draft_material *material, lam_error *error) {
    struct draft_group *grown =
        array_grow(d->groups, &d->group_capacity, d->n_groups + 1, sizeof *grown, "groups", error);
    if (grown == NULL) return LAM_ERR_MEMORY;
    d->groups = grown;
    d->groups[d->n_groups++] = (struct draft_group){name, material};
    return LAM_OK;
}

lam_status draft_face(draft *d, const double (*corners)[3], size_t n, lam_error *error) {
    lam_status status = LAM_OK;
    struct draft_face face = {{0, 0, 0, TABLE_NONE}, (uint32_t)(d->n_groups - 1)};
    if (!d->counting) {
        for (size_t k = 0; k < n; k++) TRY(point_table_add(&d->points, corners[k], &face.corners[k], error));
        struct draft_face *grown =
            array_grow(d->faces, &d->face_capacity, d->n_faces + 1, sizeof *grown, "faces", error);
        if (grown == NULL) TRY(LAM_ERR_MEMORY);
        d->faces = grown;
        d->faces[d->n_faces] = face;
    }
    d->n_faces++;
done:
    return status;
}

lam_status draft_grid(draft *d, const double quad[4][3], size_t na, size_t nb, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t j = 0; j < nb; j++)
        for (size_t i = 0; i < na; i++) {
            double cell[4][3];
            grid_point(quad, i, na, j, nb, cell[0]);
            grid_point(quad, i + 1, na, j, nb, cell[1]);
            grid_point(quad, i + 1, na, j + 1, nb, cell[2]);
            grid_point(quad, i, na, j + 1, nb, cell[3]);
            TRY(draft_face(d, (const double(*)[3])cell, 4, error));
        }
done:
    return status;
}

static size_t whole_steps(double steps) {
    return steps < 1.5 ? 1 : (size_t)lround(steps);
}

size_t draft_steps_along(const draft *d, double length, double size) {
    return whole_steps(length / (size * (d->stretch > 0 ? d->stretch : 1)));
}

size_t draft_steps_across(const draft *d, double length, double size) {
    return whole_steps(length / size * (d->stretch > 0 ? d->stretch : 1));
}

lam_status draft_cells(draft *d, const double quad[4][3], double size, lam_error *error) {
    const double along = (point_distance(quad[0], quad[1]) + point_distance(quad[3], quad[2])) / 2;
    const double across = (point_distance(quad[0], quad[3]) + point_distance(quad[1], quad[2])) / 2;
    const size_t na = draft_steps_along(d, along, size), nb = draft_steps_across(d, across, size);
    if (!d->counting) return draft_grid(d, quad, na, nb, error);
    d->n_faces += na * nb;
    return LAM_OK;
}

typedef struct near_search {
    const void *plan;
    draft_builder *build;
    const generate_options *options;
    size_t wanted;
    double off, size, stretch; /* the best so far */
} near_search;

/* Counts the faces at one cell size and keeps it when it is the best. */
static lam_status try_cells(near_search *search, double size, double stretch, size_t *n_faces,
                            lam_error *error) {
    draft counted = {.counting = true, .stretch = stretch, .plan = search->plan};
    const lam_status status = search->build(&counted, search->options, size, error);
    const double off = fabs((double)counted.n_faces - (double)search->wanted);
    if (status == LAM_OK && off < search->off)
        search->off = off, search->size = size, search->stretch = stretch;
    *n_faces = counted.n_faces;
    draft_free(&counted);
    return status;
}

lam_status draft_build_near(draft *d, draft_builder *build, const generate_options *options, size_t wanted,
                            lam_error *error) {
    lam_status status = LAM_OK;
    near_search search = {d->plan, build, options, wanted, HUGE_VAL, 1, 1};
    size_t n = 0;
    double size = 1;
    /* The number of faces goes like 1 / size^2: a few corrections come near, then what lies around is tried
     * until it is right to a thousandth. */
    for (int round = 0; round < 12 && search.off > 0; round++) {
        TRY(try_cells(&search, size, 1, &n, error));
        size *= fmin(fmax(sqrt((double)n / (double)wanted), 1.0 / 16), 16);
    }
    const double middle = search.size;
    for (int s = 0; s <= 8; s++)
        for (int step = 0; step <= 60 && search.off * 1000 > (double)wanted; step++) {
            const double stretch = 1 + .01 * (s % 2 == 1 ? (s + 1) / 2 : -s / 2);
            size = middle * (1 + .001 * (step % 2 == 1 ? (step + 1) / 2 : -step / 2));
            TRY(try_cells(&search, size, stretch, &n, error));
        }
    d->stretch = search.stretch;
    TRY(build(d, options, search.size, error));
done:
    return status;
}
