#include "solver/formfactor/buried.h"

#include "solver/formfactor/visibility/sample.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/coincident.h"

#include <math.h>
#include <stdlib.h>

/* Packets of rays to each side of an element. */
enum { PACKETS = 4 };

/* An element counts as covered from this share of its area on. */
static const double covered_share = .99;

/* An element sees the inside of a body from this share of its rays on. The underside of another body may hide
 * a part of it. */
static const double backs_share = .25;

/* Rays start this far from the plane on the side that they look to, in lengths of the element's side, or they
 * would meet what covers it: at least the first, at most the second. Between them is the distance that one
 * plane may have, as few decimals of a file may move what covers an element to its other side. */
static const double off_least = 1e-4, off_most = 1e-2;

typedef struct search {
    const mesh *m;
    const visibility *v;
    const double *shared; /* [n], m^2 */
    double reach;         /* m, of one plane */
} search;

static bool is_covered(const search *s, size_t element) {
    return s->shared[element] >= covered_share * s->m->area[element];
}

/* Rays from one side of an element, by what they meet; fronts of covered elements count as none of it. */
typedef struct meeting {
    size_t fronts, backs, nothing;
} meeting;

static meeting look(const search *s, size_t element, bool behind) {
    meeting met = {0, 0, 0};
    element_sampler sampler;
    uint32_t self[VISIBILITY_PACKET];
    const double side = sqrt(s->m->area[element]);
    const float by = (float)fmax(off_least * side, fmin(s->reach, off_most * side)) * (behind ? -1.f : 1.f);
    element_sampler_init(&sampler, s->m, s->v, element, 0);
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
    for (uint32_t p = 0; p < PACKETS; p++) {
        ray_packet rays;
        hit_packet hits;
        element_sampler_packet(&sampler, p * VISIBILITY_PACKET, &rays);
        if (behind) element_sampler_turn(&sampler, &rays);
        for (int d = 0; d < 3; d++)
            for (int i = 0; i < VISIBILITY_PACKET; i++) rays.origin[d][i] += by * sampler.frame.normal[d];
        visibility_cast(s->v, &rays, VISIBILITY_PACKET, self, 0, &hits);
        for (int i = 0; i < VISIBILITY_PACKET; i++) {
            const bool nothing = hits.element[i] == VISIBILITY_NOTHING;
            met.nothing += nothing;
            met.backs += !nothing && hits.back[i];
            met.fronts += !nothing && !hits.back[i] && !is_covered(s, hits.element[i]);
        }
    }
    return met;
}

static bool is_inside(const meeting *met) {
    return met->fronts == 0 && met->nothing == 0 &&
           (double)met->backs >= backs_share * PACKETS * VISIBILITY_PACKET;
}

static bool is_buried(const search *s, size_t element) {
    const meeting before = look(s, element, false);
    if (before.fronts > 0 || before.nothing == 0) return is_inside(&before);
    const meeting behind = look(s, element, true);
    return is_inside(&behind);
}

lam_status buried_find(mesh *m, size_t *n, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    size_t covered = 0, found = 0;
    bool *buried = NULL;
    double *shared = memory_allocate(m->n, sizeof *shared, "covered elements", error);
    search s = {.m = m, .shared = shared, .reach = coincident_reach(m)};
    if (shared == NULL) return LAM_ERR_MEMORY;
    TRY(mesh_find_sheets(m, shared, error));
    for (size_t i = 0; i < m->n; i++) covered += is_covered(&s, i);
    if (covered == 0) goto done;
    buried = memory_allocate(m->n, sizeof *buried, "covered elements", error);
    if (buried == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_create(m, &v, error));
    s.v = v;
#pragma omp parallel for schedule(dynamic, 16) reduction(+ : found)
    for (size_t i = 0; i < m->n; i++) {
        buried[i] = is_covered(&s, i) && is_buried(&s, i);
        found += buried[i];
    }
done:
    visibility_destroy(v);
    free(shared);
    if (status != LAM_OK || found == 0) {
        free(buried);
        buried = NULL;
    }
    if (status == LAM_OK) {
        free(m->buried);
        m->buried = buried;
        *n = found;
    }
    return status;
}
