#include "solver/scene/generate/patches.h"
#include "solver/base/array_grow.h"
#include "solver/scene/face_grid.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status patch_add(patch_list *list, const double (*corners)[3], size_t n, size_t group, lam_error *error) {
    if (array_grow(&list->items, &list->capacity, list->n + 1, sizeof *list->items, "patches", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    patch *p = &list->items[list->n++];
    *p = (patch){.n = (uint32_t)n, .group = (uint32_t)group};
    memcpy(p->corners, corners, n * sizeof *corners);
    return LAM_OK;
}

void patches_free(patch_list *list) {
    free(list->items);
    *list = (patch_list){0};
}

/* Draws a triangle as m^2 similar ones of the area size^2. */
static lam_status draw_triangle(scene_draft *d, const patch *p, double size, lam_error *error) {
    lam_status status = LAM_OK;
    const double(*corners)[3] = (const double(*)[3])p->corners;
    const size_t m =
        scene_draft_steps_along(d, sqrt(triangle_area(corners[0], corners[1], corners[2])), size);
    if (d->counting) {
        d->n_faces += m * m;
        return LAM_OK;
    }
    for (size_t j = 0; j < m; j++)
        for (size_t i = 0; i + j < m; i++) {
            double piece[4][3]; /* the first three upright, the last three upside down */
            triangle_point(corners, i, j, m, piece[0]);
            triangle_point(corners, i + 1, j, m, piece[1]);
            triangle_point(corners, i, j + 1, m, piece[2]);
            TRY(scene_draft_face(d, (const double(*)[3])piece, 3, error));
            if (i + j + 2 > m) continue;
            memcpy(piece[3], piece[2], sizeof *piece);
            triangle_point(corners, i + 1, j + 1, m, piece[2]);
            TRY(scene_draft_face(d, (const double(*)[3])piece + 1, 3, error));
        }
done:
    return status;
}

static lam_status draw_patch(scene_draft *d, const patch *p, double size, lam_error *error) {
    return p->n == 3 ? draw_triangle(d, p, size, error)
                     : scene_draft_cells(d, (const double(*)[3])p->corners, size, error);
}

static lam_status draw_all(scene_draft *d, const generate_options *options, double size, lam_error *error) {
    lam_status status = LAM_OK;
    const patch_list *list = d->plan;
    (void)options;
    for (size_t i = 0; d->counting && i < list->n; i++) TRY(draw_patch(d, &list->items[i], size, error));
    for (size_t g = 0; !d->counting && g < list->n_groups; g++) {
        TRY(scene_draft_group(d, list->groups[g].name, list->groups[g].material, error));
        for (size_t i = 0; i < list->n; i++)
            if (list->items[i].group == g) TRY(draw_patch(d, &list->items[i], size, error));
    }
done:
    return status;
}

lam_status patches_draw(const patch_list *list, scene_draft *d, const generate_options *options,
                        size_t wanted, lam_error *error) {
    d->plan = list;
    return scene_draft_build_near(d, draw_all, options, wanted, error);
}
