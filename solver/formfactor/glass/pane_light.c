#include "solver/formfactor/glass/pane_light.h"

#include "solver/base/random.h"
#include "solver/formfactor/rays/portals.h"
#include "solver/formfactor/rows/row_pool.h"
#include "solver/formfactor/visibility/pane_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The two patches of a quad, or one of a parallelogram or a triangle, by its corners; returns how many. */
static size_t patches_of(const mesh *m, const uint32_t e[4], plane_patch out[2]) {
    const double *a = m->vertices[e[0]], *b = m->vertices[e[1]], *c = m->vertices[e[2]];
    const bool triangle = e[3] == MESH_NO_VERTEX;
    const double *last = triangle ? c : m->vertices[e[3]];
    double off = 0, size = 0;
    out[0] = (plane_patch){.triangle = triangle};
    out[1] = (plane_patch){.triangle = true};
    for (int d = 0; d < 3; d++) {
        out[0].corner[d] = out[1].corner[d] = a[d];
        out[0].edge[0][d] = b[d] - a[d];
        out[0].edge[1][d] = last[d] - a[d];
        out[1].edge[0][d] = c[d] - a[d];
        out[1].edge[1][d] = last[d] - a[d];
        off += fabs(a[d] - b[d] + c[d] - last[d]);
        size += fabs(c[d] - a[d]);
    }
    if (triangle || off <= 1e-6 * size) return 1;
    out[0].triangle = true;
    memcpy(out[0].edge[1], out[1].edge[0], sizeof out[0].edge[1]);
    return 2;
}

/* True for a piece of a pane; a back is in the place of its front. */
static bool is_of_pane(const mesh *m, const facets *f, size_t piece) {
    return mesh_is_pane(m, f->elements[f->first[f->piece_facet[piece]]]);
}

/* Panes as portals, that rays are aimed at: their facets, however finely they are divided. Freed by
 * portals_free. */
static lam_status panes_as_portals(const mesh *m, const visibility *v, portals *out, lam_error *error) {
    lam_status status = LAM_OK;
    const facets *const f = visibility_facets(v);
    size_t n = 0;
    portal *array = NULL;
    for (size_t p = 0; p < f->n_pieces; p++) n += is_of_pane(m, f, p);
    array = memory_allocate(2 * n + 1, sizeof *array, "panes", error);
    if (array == NULL) return LAM_ERR_MEMORY;
    n = 0;
    for (size_t p = 0; p < f->n_pieces; p++) {
        plane_patch patches[2];
        if (!is_of_pane(m, f, p)) continue;
        const size_t count = patches_of(m, f->pieces[p], patches);
        for (size_t k = 0; k < count; k++) {
            array[n] = portal_of(&patches[k], visibility_centre(v));
            array[n].strength[0] = array[n].strength[1] = 1;
            n++;
        }
    }
    TRY(portals_build(array, n, out, error));
done:
    return status;
}

typedef struct pane_context {
    const mesh *m;
    const visibility *v;
    const portals *panes;
    const sky_bounce *sky;
    size_t rays;
    uint64_t seed;
    bool without_rows;
} pane_context;

/* The rays of one element. */
typedef struct pane_row {
    const pane_context *c;
    const portal_aim *aim;
    row_pool *pool;
} pane_row;

static void meet(void *context, size_t i, uint32_t element, double weight) {
    pane_row *const row = context;
    (void)i;
    if (weight > 0 && !row->c->without_rows) row_pool_add(row->pool, element, weight);
}

/* Casts a packet of directions of length 1, whose lanes with cosine 0 do not count, and follows it. */
static void cast(pane_row *row, uint32_t element, ray_packet *rays, const double cosine[VISIBILITY_PACKET]) {
    const pane_context *c = row->c;
    const pane_visitor visitor = {meet, row};
    uint32_t self[VISIBILITY_PACKET];
    double weight[VISIBILITY_PACKET];
    unsigned leaving = 0;
    hit_packet hits;
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = element;
    visibility_cast(c->v, rays, VISIBILITY_PACKET, self, VISIBILITY_TOGETHER, &hits);
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        const bool pane = hits.element[i] != VISIBILITY_NOTHING && mesh_is_pane(c->m, hits.element[i]);
        double origin[3], direction[3];
        weight[i] = 0;
        if (!pane || !(cosine[i] > 0)) {
            hits.element[i] = VISIBILITY_NOTHING;
            continue;
        }
        for (int d = 0; d < 3; d++) {
            origin[d] = (double)rays->origin[d][i];
            direction[d] = (double)rays->direction[d][i];
        }
        weight[i] =
            portals_weight(c->panes, row->aim, c->rays, origin, direction, cosine[i]) / (double)c->rays;
    }
    pane_path_follow(c->v, c->m, rays, VISIBILITY_PACKET, &hits, weight, &visitor);
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        if (!(weight[i] > 0)) continue;
        if (hits.element[i] == VISIBILITY_NOTHING)
            leaving |= 1u << i;
        else if (!hits.back[i])
            meet(row, (size_t)i, hits.element[i], weight[i]);
    }
    if (c->sky != NULL) row_pool_leave(row->pool, c->sky, rays, leaving, weight);
}

/* Half of the rays by the cosine, half of them towards panes. */
static void trace_row(pane_row *row, uint32_t element) {
    const pane_context *c = row->c;
    element_sampler sampler;
    pair_sampler points;
    element_sampler_init(&sampler, c->m, c->v, element, c->seed);
    pair_sampler_init(&points, c->seed ^ RANDOM_STEP, element, c->m->n);
    for (uint32_t first = 0; first < c->rays; first += VISIBILITY_PACKET) {
        double x[4][VISIBILITY_PACKET], direction[VISIBILITY_PACKET][3], cosine[VISIBILITY_PACKET];
        ray_packet rays;
        element_sampler_packet(&sampler, first, &rays);
        for (int i = 0; i < VISIBILITY_PACKET; i++) {
            cosine[i] = 0;
            for (int d = 0; d < 3; d++)
                cosine[i] += (double)sampler.frame.normal[d] * (double)rays.direction[d][i];
        }
        cast(row, element, &rays, cosine);
        pair_sampler_packet(&points, first, x);
        portals_rays(c->panes, row->aim, &sampler, (const double(*)[VISIBILITY_PACKET])x, &rays, direction,
                     cosine);
        cast(row, element, &rays, cosine);
    }
}

static void make_row(const void *context, size_t element, row_pool *pool, double *leaving, double *absorbed) {
    const pane_context *c = context;
    portal_aim aim;
    pane_row row = {.c = c, .aim = &aim, .pool = pool};
    *leaving = *absorbed = 0;
    if (mesh_is_buried(c->m, element)) return;
    portals_aim(c->panes, c->m, c->v, element, &aim);
    if (aim.n > 0) trace_row(&row, (uint32_t)element);
}

lam_status pane_light_make(const mesh *m, const visibility *v, const uint32_t *order,
                           const pane_light_options *options, packed_rows *rows, lam_error *error) {
    lam_status status = LAM_OK;
    portals panes = {.n = 0};
    double *unused = memory_allocate(m->n, 2 * sizeof *unused, "panes", error);
    if (unused == NULL) return LAM_ERR_MEMORY;
    TRY(panes_as_portals(m, v, &panes, error));
    panes.rays = options->rays;
    const pane_context c = {.m = m,
                            .v = v,
                            .panes = &panes,
                            .sky = options->sky,
                            .rays = options->rays,
                            .seed = options->recipe->seed,
                            .without_rows = options->without_rows};
    const row_maker maker = {.make = make_row,
                             .context = &c,
                             .kind = ROW_WEIGHTS,
                             .rays = 2 * options->rays,
                             .whole = 1,
                             .sky = options->sky,
                             .cheaper = "fewer --rays",
                             .progress = options->progress,
                             .stage = options->stage,
                             .m = m,
                             .recipe = options->recipe};
    TRY(row_pool_make(&maker, order, rows, unused, unused + m->n, error));
done:
    portals_free(&panes);
    free(unused);
    return status;
}
