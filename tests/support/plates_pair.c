#include "support/plates_pair.h"

#include "support/suite.h"

#include <stdlib.h>

void plates_pair_open(plates_pair *p, mesh m) {
    lam_error error = {0};
    *p = (plates_pair){.m = m};
    free(p->m.area);
    free(p->m.normal);
    p->m.area = NULL;
    p->m.normal = NULL;
    ck_assert_msg(mesh_measure(&p->m, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(visibility_create(&p->m, &p->v, &error) == LAM_OK, "%s", error.message);
    ck_assert(occluders_make(&p->m, visibility_facets(p->v), visibility_rounding(p->v), &p->occluders,
                             &error) == LAM_OK);
    polygon_of_element(&p->m, 0, &p->a);
    polygon_of_element(&p->m, 1, &p->b);
    for (size_t k = 0; k < p->occluders.n && p->among.count < UNCUT_OCCLUDERS_MOST; k++)
        if (p->occluders.of[k].facet >= 2) p->among.of[p->among.count++] = (uint32_t)k;
}

void plates_pair_close(plates_pair *p) {
    occluders_free(&p->occluders);
    visibility_destroy(p->v);
    mesh_free(&p->m);
}
