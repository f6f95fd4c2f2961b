#include "solver/formfactor/leaving.h"

#include "solver/formfactor/visibility/openings.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/scene/glass.h"

#include <math.h>
#include <stdlib.h>

static double area_mean(const mesh *m, const double *x) {
    double sum = 0, total = 0;
    for (size_t i = 0; i < m->n; i++) {
        if (!mesh_is_buried(m, i)) sum += m->area[i] * x[i];
        total += m->area[i];
    }
    return total > 0 ? sum / total : 0;
}

/* True for an element whose rays are lost through no gap of a room: one below a body, and a pane, one side of
 * which looks outside. */
static bool is_apart(const mesh *m, size_t element) {
    return mesh_is_buried(m, element) || mesh_is_pane(m, element);
}

/* Lost rays of each kind that are followed, and rays that are cast at most to find one of them. */
enum { FOLLOWED = 64, SEARCHED_MOST = 1 << 16, RAYS_BESIDE_HEMICUBES = 1024 };

/* The lost rays of one kind: those that leave the scene, or those that meet backs. */
typedef struct lost_rays {
    const mesh *m;
    const visibility *v;
    const double *share; /* [n], of an element's rays that are lost so */
    size_t n_rays;       /* of an element */
    uint64_t seed;
    bool back;
    double width; /* of a crack */
} lost_rays;

/* sum A_i share_i of all rays that gaps may have lost. */
static double lost_light(const lost_rays *l) {
    double sum = 0;
    for (size_t i = 0; i < l->m->n; i++)
        if (!is_apart(l->m, i)) sum += l->m->area[i] * l->share[i];
    return sum;
}

/* The elements of FOLLOWED rays that are spread evenly over that light. */
static void elements_of_lost(const lost_rays *l, double light, uint32_t *element) {
    double passed = 0;
    size_t k = 0, last = 0;
    for (size_t i = 0; i < l->m->n && k < FOLLOWED; i++) {
        if (!(l->share[i] > 0) || is_apart(l->m, i)) continue;
        passed += l->m->area[i] * l->share[i];
        last = i;
        for (; k < FOLLOWED && (k + .5) / FOLLOWED * light < passed; k++) element[k] = (uint32_t)i;
    }
    for (; k < FOLLOWED; k++) element[k] = (uint32_t)last;
}

/* Finds a lost ray of an element, from ray number `first` on, and follows it: 1 where it passes an opening, 0
 * where it passes a crack, -1 where no ray was lost. */
static int follow_one(const lost_rays *l, uint32_t element, size_t first) {
    const size_t n = l->n_rays < SEARCHED_MOST ? l->n_rays : SEARCHED_MOST;
    const size_t packets = (n + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET;
    element_sampler sampler;
    uint32_t self[VISIBILITY_PACKET];
    element_sampler_init(&sampler, l->m, l->v, element, l->seed);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) self[i] = element;
    for (size_t p = 0; p < packets; p++) {
        const size_t ray = (first + p) % packets * VISIBILITY_PACKET;
        const size_t count = n - ray < VISIBILITY_PACKET ? n - ray : VISIBILITY_PACKET;
        ray_packet rays;
        hit_packet hits;
        element_sampler_packet(&sampler, (uint32_t)ray, &rays);
        visibility_cast(l->v, &rays, count, self, VISIBILITY_TOGETHER, &hits);
        for (size_t i = 0; i < count; i++) {
            const bool left = hits.element[i] == VISIBILITY_NOTHING;
            if (l->back ? left || !hits.back[i] : !left) continue;
            const float origin[3] = {rays.origin[0][i], rays.origin[1][i], rays.origin[2][i]};
            const float direction[3] = {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
            return !openings_is_crack(l->v, l->m, l->width, origin, direction, element);
        }
    }
    return -1;
}

/* The share of the lost light that passes openings; 0 where no ray was found again. */
static double share_through_openings(const lost_rays *l) {
    const double light = lost_light(l);
    uint32_t element[FOLLOWED];
    int found[FOLLOWED];
    size_t openings = 0, all = 0;
    if (!(light > 0)) return 0;
    elements_of_lost(l, light, element);
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < FOLLOWED; k++) /* an element that is taken again begins with another ray */
        found[k] = follow_one(l, element[k], k * l->n_rays / FOLLOWED / VISIBILITY_PACKET);
    for (size_t k = 0; k < FOLLOWED; k++) {
        openings += found[k] == 1;
        all += found[k] >= 0;
    }
    return all > 0 ? (double)openings / (double)all : 0;
}

/* True where light leaves from panes: a part of it that is more than cracks make. */
static bool has_window(const form_factors *f, const mesh *m) {
    static const double least = .01;
    for (size_t i = 0; m->glass != NULL && i < m->n; i++)
        if (mesh_is_pane(m, i) && f->leaving[i] + f->absorbed[i] > least) return true;
    return false;
}

void leaving_measure(form_factors *f, const mesh *m, const visibility *v) {
    lost_rays l = {.m = m,
                   .v = v,
                   .n_rays = f->recipe.rays > 0 ? f->recipe.rays : RAYS_BESIDE_HEMICUBES,
                   .seed = f->recipe.seed,
                   .width = openings_crack_width(m)};
    f->leaving_share = area_mean(m, f->leaving);
    f->absorbed_share = area_mean(m, f->absorbed);
    f->outlet = (scene_outlet){.crack_width = l.width};
    l.share = f->leaving;
    f->outlet.openings = share_through_openings(&l);
    l.share = f->absorbed;
    l.back = true;
    f->outlet.fronts_only = share_through_openings(&l) <= LEAVING_OPEN;
    const bool cracks = f->recipe.closure == CLOSURE_MEASURED ? f->outlet.openings <= LEAVING_OPEN
                                                              : f->recipe.closure == CLOSURE_CLOSED;
    f->outlet.panes_only = cracks && has_window(f, m);
    f->closed = cracks && !f->outlet.panes_only;
}

/* True for an element whose row keeps what it loses: nearly empty ones. */
static bool is_kept(const form_factors *f, const mesh *m, size_t element) {
    return mesh_is_buried(m, element) || (f->outlet.panes_only && mesh_is_pane(m, element));
}

static double absorbed(const form_factors *f, const mesh *m, size_t element) {
    return f->outlet.fronts_only && !is_kept(f, m, element) ? 0 : f->absorbed[element];
}

bool leaving_nothing(const form_factors *f) {
    return f->closed && f->outlet.fronts_only;
}

bool leaving_by_panes(const form_factors *f) {
    return f->outlet.panes_only && f->outlet.fronts_only;
}

double leaving_outside(const form_factors *f, const mesh *m, size_t element) {
    const bool sealed = (f->closed || f->outlet.panes_only) && !is_kept(f, m, element);
    return (sealed ? 0 : f->leaving[element]) + absorbed(f, m, element);
}

lam_status leaving_to_sky(form_factors *f, const mesh *m, lam_error *error) {
    const size_t n = m->n;
    double *scale = memory_allocate(n, sizeof *scale, "first bounce of the sky", error);
    if (scale == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) {
        const double outside = f->leaving[i] + absorbed(f, m, i);
        const double opaque = f->row_sums[i] - (f->through != NULL ? f->through[i] : 0);
        scale[i] = f->closed || outside <= 0 || mesh_is_buried(m, i) ? 0 : fmax(0, 1 - opaque) / outside;
    }
    sky_bounce_close(&f->sky, scale);
    free(scale);
    return LAM_OK;
}
