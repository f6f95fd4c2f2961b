#include "solver/scene/coincident_order.h"

#include "solver/base/union_find.h"
#include "solver/scene/box_pairs.h"
#include "solver/scene/coincident_pairs.h"
#include "solver/scene/texture.h"

#include <math.h>
#include <stdlib.h>

bool coincident_face_emits(const mesh *m, size_t face) {
    bool any = false;
    for (size_t c = 0; c < m->n_channels; c++) any |= m->emission[c * m->n + face] > 0;
    return any;
}

bool coincident_faces_differ(const mesh *m, size_t a, size_t b) {
    bool any = m->group[a] != m->group[b];
    if (m->textured_face != NULL)
        any |= (m->textured_face[a] == TEXTURE_NONE) != (m->textured_face[b] == TEXTURE_NONE);
    for (size_t c = 0; c < m->n_channels; c++)
        any |= m->reflectance[c * m->n + a] != m->reflectance[c * m->n + b] ||
               m->emission[c * m->n + a] != m->emission[c * m->n + b];
    return any;
}

typedef struct joining {
    const mesh *m;
    uint32_t *surface;
    coincident_planes planes;
} joining;

static lam_status join(void *context, uint32_t i, uint32_t j, lam_error *error) {
    const joining *s = context;
    (void)error; /* it cannot fail */
    if (!coincident_faces_differ(s->m, i, j) && coincident_share_plane(&s->planes, i, j))
        union_find_join(s->surface, i, j);
    return LAM_OK;
}

/* Sums of the same squares in another sequence are one. */
static double six_digits(double x) {
    int exponent;
    const double mantissa = frexp(x, &exponent);
    return ldexp(round(ldexp(mantissa, 20)), exponent - 20);
}

lam_status coincident_order_find(const mesh *m, coincident_order *out, lam_error *error) {
    lam_status status = LAM_OK;
    bool cut;
    coincident_order o = {0};
    o.surface = memory_allocate(m->n, sizeof *o.surface, "surfaces", error);
    o.area = memory_allocate(m->n, sizeof *o.area, "surfaces", error);
    o.emits = memory_allocate(m->n, sizeof *o.emits, "surfaces", error);
    if (o.surface == NULL || o.area == NULL || o.emits == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t i = 0; i < m->n; i++) o.surface[i] = i;
    joining s = {.m = m, .surface = o.surface, .planes = coincident_planes_of(m)};
    /* Neighbours have the axis of an edge in common, or a slanting edge none. */
    const box_pairs how = {.distance = s.planes.reach, .long_axes = 0, .visit = join, .context = &s};
    TRY(box_pairs_visit(m, &how, &cut, error));
    for (uint32_t i = 0; i < m->n; i++) {
        o.surface[i] = union_find_root(o.surface, i);
        o.area[o.surface[i]] += m->area[i];
        o.emits[o.surface[i]] |= coincident_face_emits(m, i);
    }
    for (size_t i = 0; i < m->n; i++) o.area[i] = six_digits(o.area[i]);
    *out = o;
    o = (coincident_order){0};
done:
    coincident_order_free(&o);
    return status;
}

void coincident_order_free(coincident_order *o) {
    free(o->surface);
    free(o->area);
    free(o->emits);
    *o = (coincident_order){0};
}

bool coincident_comes_first(const coincident_order *o, uint32_t a, uint32_t b) {
    const uint32_t p = o->surface[a], q = o->surface[b];
    if (p == q) return a < b;
    if (o->area[p] != o->area[q]) return o->area[p] < o->area[q];
    if (o->emits[p] != o->emits[q]) return o->emits[p];
    return p < q;
}
