/* Contact: faces of one plane that look at each other, such as the two sides of a sheet, the bottom of a box
 * and the floor below it, whose decimals put one before the other here and behind it there. Neither is to
 * block what the other sees: rays and segments of both begin above whatever of the other rises over them.
 * Found by short rays through some points of every element: overlaps that none of them meets are small. */
#include "solver/formfactor/visibility/visibility_private.h"

#include "solver/base/vector3.h"
#include "solver/scene/element_face.h"

#include <stdlib.h>

/* Less than this share of visibility_rounding is left to that. */
static const double least_rise = .25;

/* The data of the filter: one element, and what it came in contact with. */
typedef struct contact_search {
    embree_query query; /* first: the filter gets a pointer to it */
    const visibility *v;
    const float *sizes; /* [facets]: the radius of the largest element */
    const element_face *own;
    uint32_t own_facet;
    float *rise; /* [facets] */
} contact_search;

/* The largest height of a corner of `of` over the plane of `from`; of two-sided faces, its distance. */
static double rise_over(const element_face *of, const element_face *from, bool both_sides) {
    double most = 0;
    for (int c = 0; c < of->n; c++) {
        double to[3];
        subtract3(of->corner[c], from->centre, to);
        const double height = dot3(to, from->normal);
        most = fmax(most, both_sides ? fabs(height) : height);
    }
    return most;
}

static void lift_to(float *rise, double to) {
    float above = nextafterf((float)to, INFINITY);
    float before;
    __atomic_load(rise, &before, __ATOMIC_RELAXED);
    while (before < above &&
           !__atomic_compare_exchange(rise, &before, &above, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
}

/* Notes a piece that the element is in contact with. A piece counts as of the size of its facet's elements.
 */
static void note(const contact_search *s, uint32_t piece) {
    const visibility *v = s->v;
    const uint32_t facet = v->facets.piece_facet[piece];
    element_face other;
    if (facet == s->own_facet || !element_face_set(v->mesh, v->facets.pieces[piece], &other)) return;
    if (!(dot3(other.normal, s->own->normal) < -plane_parallel)) return;
    if (!element_faces_share_plane(s->own, s->own->radius, &other, (double)s->sizes[facet])) return;
    const double limit = plane_slack(2 * s->own->radius, 2 * (double)s->sizes[facet]);
    const double off = s->own->off + other.off, over_own = rise_over(&other, s->own, v->mesh->two_sided),
                 over_other = rise_over(s->own, &other, v->mesh->two_sided);
    /* Corners of a much larger face may be far over the plane of a small one that tilts. */
    const double own_rise = off + (over_own <= limit ? over_own : over_other),
                 other_rise = off + (over_other <= limit ? over_other : over_own);
    if (!(fmax(own_rise, other_rise) > least_rise * (double)v->rounding)) return;
    lift_to(&s->rise[facet], other_rise);
    lift_to(&s->rise[s->own_facet], own_rise);
}

/* Notes every hit and accepts none. */
static void note_all(const struct RTCFilterFunctionNArguments *args) {
    const contact_search *s = (const contact_search *)args->context;
    const size_t n = args->N;
    const unsigned *id = (const unsigned *)args->hit + HIT_PRIMITIVE * n;
    const unsigned *geometry = (const unsigned *)args->hit + HIT_GEOMETRY * n;
    for (size_t i = 0; i < n; i++) {
        if (args->valid[i] == 0) continue;
        args->valid[i] = 0;
        note(s, s->v->primitives[geometry[i]][id[i]].piece);
    }
}

/* Casts rays through points of an element, from `reach` below to as much above. */
static void search(contact_search *s, double reach) {
    static const double place[VISIBILITY_PACKET][2] = {{.05, .05}, {.94, .06}, {.93, .92}, {.07, .95},
                                                       {.31, .37}, {.66, .28}, {.71, .67}, {.27, .74}};
    const element_face *own = s->own;
    struct RTCRayHit8 ray __attribute__((aligned(32)));
    int active[VISIBILITY_PACKET] __attribute__((aligned(32)));
    ray_packet rays;
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        double u = place[k][0], w = place[k][1], from[3];
        float origin[3];
        const bool beyond = own->n == 3 && u + w > 1; /* the square folded along its diagonal */
        if (beyond) u = 1 - u, w = 1 - w;
        const double of[4] = {own->n == 3 ? 1 - u - w : (1 - u) * (1 - w), own->n == 3 ? u : u * (1 - w),
                              own->n == 3 ? w : u * w, own->n == 3 ? 0 : (1 - u) * w};
        for (int d = 0; d < 3; d++) {
            from[d] = -reach * own->normal[d];
            for (int c = 0; c < own->n; c++) from[d] += of[c] * own->corner[c][d];
        }
        visibility_recentre(s->v, from, origin);
        for (int d = 0; d < 3; d++) {
            rays.origin[d][k] = origin[d];
            rays.direction[d][k] = (float)(2 * reach * own->normal[d]);
        }
        active[k] = -1;
    }
    packet_set(&ray, &rays);
    for (int k = 0; k < VISIBILITY_PACKET; k++) ray.ray.tfar[k] = 1;
    embree_query_init(&s->query);
    s->query.coherent = true;
    s->query.filter = note_all;
    embree_occluded(active, s->v->scene, &s->query, &ray.ray);
}

/* The radius of the largest element of each facet, and of all. */
static double set_sizes(const visibility *v, float *sizes) {
    double largest = 0;
    for (size_t i = 0; i < v->n_fronts; i++) {
        element_face face;
        float *of = &sizes[v->facets.of_element[i]];
        if (!element_face_set(v->mesh, v->mesh->elements[i], &face)) continue;
        *of = fmaxf(*of, (float)face.radius);
        largest = fmax(largest, face.radius);
    }
    return largest;
}

lam_status visibility_find_contacts(visibility *v, lam_error *error) {
    lam_status status = LAM_OK;
    float *rise = memory_allocate(v->facets.n, sizeof *rise, "visibility", error);
    float *sizes = memory_allocate(v->facets.n, sizeof *sizes, "visibility", error);
    bool any = false;
    if (rise == NULL || sizes == NULL) TRY(LAM_ERR_MEMORY);
    const double largest = set_sizes(v, sizes);
#pragma omp parallel for schedule(dynamic, 256)
    for (size_t i = 0; i < v->n_fronts; i++) {
        element_face own;
        contact_search s = {
            .v = v, .sizes = sizes, .own = &own, .own_facet = v->facets.of_element[i], .rise = rise};
        if (!element_face_set(v->mesh, v->mesh->elements[i], &own)) continue;
        const double reach = plane_slack(2 * largest, 2 * own.radius) + 2 * own.off;
        if (reach > least_rise * (double)v->rounding) search(&s, reach + (double)v->rounding);
    }
    for (size_t f = 0; f < v->facets.n; f++) any = any || rise[f] > 0;
    if (!any) goto done;
    v->rise = rise;
    rise = NULL;
done:
    free(rise);
    free(sizes);
    return status;
}

double visibility_rise(const visibility *v, size_t element) {
    if (v->rise == NULL) return 0;
    return (double)v->rise[v->facets.of_element[element < v->n_fronts ? element : element - v->n_fronts]];
}
