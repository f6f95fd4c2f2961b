/* Embree's scene is made of facets, and rays are cast in packets: origins are lifted by 2 rounding + rise
 * along the normal, rounding = 4 2^-24 (radius of the scene), so that rays pass their own facet; the few that
 * hit it are cast again with a filter. facet_grid.h then finds the element that was hit. */
#include "solver/formfactor/visibility/visibility_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static lam_status device_error(const visibility *v, const char *what, lam_error *error) {
    enum RTCError code = rtcGetDeviceError(v->device);
    if (code == RTC_ERROR_OUT_OF_MEMORY)
        return status_fail(error, LAM_ERR_MEMORY, "Embree: %s: out of memory; use a smaller scene", what);
    return status_fail(error, LAM_ERR_INTERNAL, "Embree: %s: error %d", what, (int)code);
}

/* Adds the triangles or the quads among the facets' pieces as one geometry with its own copy of the vertices;
 * their primitives begin at `first` of all, and their number is added to it. */
static lam_status add_geometry(visibility *v, int kind, size_t *first, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = v->mesh;
    const facets *f = &v->facets;
    const size_t corners = kind == TRIANGLES ? 3 : 4;
    RTCGeometry geometry = NULL;
    size_t count = 0;
    for (size_t p = 0; p < f->n_pieces; p++) count += corner_count(f->pieces[p]) == corners;
    v->primitives[kind] = v->all + *first;
    *first += count;
    if (count == 0) goto done;

    geometry =
        rtcNewGeometry(v->device, kind == TRIANGLES ? RTC_GEOMETRY_TYPE_TRIANGLE : RTC_GEOMETRY_TYPE_QUAD);
    if (geometry == NULL) {
        status = device_error(v, "new geometry", error);
        goto done;
    }
    float *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                              3 * sizeof(float), m->n_vertices);
    uint32_t *indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                kind == TRIANGLES ? RTC_FORMAT_UINT3 : RTC_FORMAT_UINT4,
                                                corners * sizeof(uint32_t), count);
    if (vertices == NULL || indices == NULL) {
        status = device_error(v, "geometry buffers", error);
        goto done;
    }
    for (size_t i = 0; i < m->n_vertices; i++) visibility_recentre(v, m->vertices[i], vertices + 3 * i);
    size_t prim = 0;
    for (size_t p = 0; p < f->n_pieces; p++) {
        if (corner_count(f->pieces[p]) != corners) continue;
        for (size_t c = 0; c < corners; c++) indices[prim * corners + c] = f->pieces[p][c];
        const uint32_t facet = f->piece_facet[p];
        const bool alone = f->first[facet + 1] - f->first[facet] == 1;
        primitive *const out = &v->primitives[kind][prim++];
        *out = (primitive){.piece = (uint32_t)p,
                           .facet = facet,
                           .element = alone ? f->elements[f->first[facet]] : MESH_NO_VERTEX};
        memcpy(out->normal, f->normal[facet], sizeof out->normal);
    }
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(v->scene, geometry, (unsigned)kind);
done:
    if (geometry != NULL) rtcReleaseGeometry(geometry);
    return status;
}

static lam_status create(const mesh *m, bool join, visibility **out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = memory_allocate(1, sizeof *v, "visibility", error);
    if (v == NULL) return LAM_ERR_MEMORY;
    v->mesh = m;
    v->n_fronts = m->two_sided ? m->n / 2 : m->n;
    double radius;
    size_t first = 0;
    mesh_bounds(m, v->centre, &radius);
    v->rounding = 4 * 0x1p-24f * (float)radius;
    if (join)
        TRY(facets_join(m, v->n_fronts, (double)v->rounding, &v->facets, error));
    else
        TRY(facets_alone(m, v->n_fronts, &v->facets, error));
    TRY(facet_grids_create(m, &v->facets, &v->grids, error));
    v->all = memory_allocate(v->facets.n_pieces, sizeof *v->all, "visibility", error);
    if (v->all == NULL) TRY(LAM_ERR_MEMORY);

    /* One thread: the hierarchy is built in a fraction of a second, and rays are cast by our own threads. */
    v->device = rtcNewDevice("threads=1,user_threads=0,set_affinity=0");
    if (v->device == NULL) FAIL(error, LAM_ERR_INTERNAL, "Embree: cannot make a device");
    v->scene = rtcNewScene(v->device);
    if (v->scene == NULL) TRY(device_error(v, "new scene", error));
    rtcSetSceneFlags(v->scene, RTC_SCENE_FLAG_ROBUST | (enum RTCSceneFlags)EMBREE_FILTERS_QUERIES);
    rtcSetSceneBuildQuality(v->scene, RTC_BUILD_QUALITY_HIGH);
    TRY(add_geometry(v, TRIANGLES, &first, error));
    TRY(add_geometry(v, QUADS, &first, error));
    rtcCommitScene(v->scene);
    if (rtcGetDeviceError(v->device) != RTC_ERROR_NONE)
        FAIL(error, LAM_ERR_INTERNAL, "Embree: cannot build the scene of %zu elements", m->n);
    TRY(visibility_find_contacts(v, error));
    *out = v;
    v = NULL;
done:
    visibility_destroy(v);
    return status;
}

lam_status visibility_create(const mesh *m, visibility **out, lam_error *error) {
    return create(m, true, out, error);
}

lam_status visibility_create_of_elements(const mesh *m, visibility **out, lam_error *error) {
    return create(m, false, out, error);
}

void visibility_destroy(visibility *v) {
    if (v == NULL) return;
    if (v->scene != NULL) rtcReleaseScene(v->scene);
    if (v->device != NULL) rtcReleaseDevice(v->device);
    free(v->all);
    free(v->rise);
    facets_free(&v->facets);
    facet_grids_free(&v->grids);
    free(v);
}

const facets *visibility_facets(const visibility *v) {
    return &v->facets;
}

void visibility_recentre(const visibility *v, const double point[3], float recentred[3]) {
    for (int d = 0; d < 3; d++) recentred[d] = (float)(point[d] - v->centre[d]);
}

const double *visibility_centre(const visibility *v) {
    return v->centre;
}

double visibility_rounding(const visibility *v) {
    return (double)v->rounding;
}

/* The data of the filter. The query comes first, because the filter gets a pointer to its context. */
typedef struct cast_context {
    embree_query query;
    const visibility *visibility;
    bool cull_back;
} cast_context;

/* Rejects hits on the facet that a ray leaves, whose index is the ray's id, on faces in its plane, and on
 * culled backs. Nine rays of ten hit their own facet at distance 0: rejecting that inside the traversal
 * avoids a second cast. */
static void refuse_own_and_culled(const struct RTCFilterFunctionNArguments *args) {
    const cast_context *context = (const cast_context *)args->context;
    const visibility *v = context->visibility;
    const size_t n = args->N;
    const float *direction = (const float *)args->ray + RAY_DIRECTION * n;
    const float *distance = (const float *)args->ray + RAY_DISTANCE * n;
    const unsigned *own = (const unsigned *)args->ray + RAY_ID * n;
    const unsigned *id = (const unsigned *)args->hit + HIT_PRIMITIVE * n;
    const unsigned *geometry = (const unsigned *)args->hit + HIT_GEOMETRY * n;
    for (size_t i = 0; i < n; i++) {
        if (args->valid[i] == 0) continue;
        const uint32_t facet = facet_of(v, geometry[i], id[i]);
        const float cosine = along_normal(v, facet, direction[i], direction[n + i], direction[2 * n + i]);
        if (facet == own[i] || (context->cull_back && cosine >= 0) ||
            (own[i] != VISIBILITY_NOTHING && in_own_plane(v, facet, own[i], distance[i] * fabsf(cosine))))
            args->valid[i] = 0;
    }
}

/* The facets that a packet's rays hit first, and the components of the directions along their normals;
 * VISIBILITY_NOTHING and 0 for rays that hit nothing. */
typedef struct met_packet {
    uint32_t facet[VISIBILITY_PACKET];
    float cosine[VISIBILITY_PACKET];
} met_packet;

/* A sheet modelled as two faces in one place is hit at its front and at its back at the same distance, or the
 * back is hit first where it rises above the front. Where a back was found, casts again for such a front and
 * prefers it; the hit stays where the ray first met the sheet. */
static void prefer_fronts(const visibility *v, const met_packet *met, cast_context *context,
                          struct RTCRayHit8 *ray) {
    const float *cosine = met->cosine;
    struct RTCRayHit8 again = *ray;
    int active[VISIBILITY_PACKET] __attribute__((aligned(32)));
    bool any = false;
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        active[i] = cosine[i] > 0 ? -1 : 0;
        if (cosine[i] <= 0) continue;
        any = true;
        const float slack = (v->rounding + rise_of(v, met->facet[i])) / cosine[i];
        again.ray.tnear[i] = fmaxf(0, ray->ray.tfar[i] - slack);
        again.ray.tfar[i] = ray->ray.tfar[i] + slack;
        again.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    if (!any) return;
    context->cull_back = true;
    embree_intersect(active, v->scene, &context->query, &again);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        if (cosine[i] <= 0 || again.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
        const bool same_place = !(rise_of(v, met->facet[i]) > 0) ||
                                fabsf(again.ray.tfar[i] - ray->ray.tfar[i]) <= v->rounding / cosine[i];
        const uint32_t front = facet_of(v, again.hit.geomID[i], again.hit.primID[i]);
        if (!same_place && !(cosine_between(v, front, met->facet[i]) < (float)-plane_parallel)) continue;
        ray->hit.geomID[i] = again.hit.geomID[i];
        ray->hit.primID[i] = again.hit.primID[i];
        ray->hit.u[i] = again.hit.u[i];
        ray->hit.v[i] = again.hit.v[i];
        if (same_place) ray->ray.tfar[i] = again.ray.tfar[i];
    }
}

static void facets_met(const visibility *v, const struct RTCRayHit8 *ray, size_t n_rays, met_packet *met) {
    for (size_t i = 0; i < n_rays; i++) {
        met->facet[i] = VISIBILITY_NOTHING;
        met->cosine[i] = 0;
        if (ray->hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
        met->facet[i] = facet_of(v, ray->hit.geomID[i], ray->hit.primID[i]);
        met->cosine[i] =
            along_normal(v, met->facet[i], ray->ray.dir_x[i], ray->ray.dir_y[i], ray->ray.dir_z[i]);
    }
}

/* Moves origins above their own facet's plane, and what rises above it, by more than rounding, so that rays
 * cannot hit it and the cast needs no filter, which would take a third of all time. */
static void lift(const visibility *v, const uint32_t *self, size_t n_rays, struct RTCRayHit8 *ray) {
    for (size_t i = 0; i < n_rays; i++) {
        if (self[i] == VISIBILITY_NOTHING) continue;
        const float height = 2 * v->rounding + rise_of(v, ray->ray.id[i]);
        const float *normal = v->mesh->normal[self[i]];
        ray->ray.org_x[i] += height * normal[0];
        ray->ray.org_y[i] += height * normal[1];
        ray->ray.org_z[i] += height * normal[2];
    }
}

/* Casts the rays of a packet that leave elements, lifted and without the filter. The few that hit their own
 * facet nevertheless (not quite planar), or one in its plane, are cast again from their origin, with the
 * filter. */
static void cast_lifted(const visibility *v, const ray_packet *rays, const uint32_t *self, size_t n_rays,
                        cast_context *context, int active[VISIBILITY_PACKET], struct RTCRayHit8 *ray,
                        met_packet *met) {
    bool any = false;
    lift(v, self, n_rays, ray);
    context->query.filter = NULL;
    embree_intersect(active, v->scene, &context->query, ray);
    context->query.filter = refuse_own_and_culled;
    facets_met(v, ray, n_rays, met);
    for (size_t i = 0; i < n_rays; i++) {
        const uint32_t own = ray->ray.id[i], facet = met->facet[i];
        const bool again =
            own != VISIBILITY_NOTHING && facet != VISIBILITY_NOTHING &&
            (facet == own || in_own_plane(v, facet, own, ray->ray.tfar[i] * fabsf(met->cosine[i])));
        active[i] = again ? -1 : 0;
        any = any || again;
        if (!again) continue;
        ray->ray.org_x[i] = rays->origin[0][i];
        ray->ray.org_y[i] = rays->origin[1][i];
        ray->ray.org_z[i] = rays->origin[2][i];
        ray->ray.tfar[i] = INFINITY;
        ray->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    if (!any) return;
    embree_intersect(active, v->scene, &context->query, ray);
    facets_met(v, ray, n_rays, met);
}

/* The elements of the hits of a packet, whose facets and cosines are met. */
static void report(const visibility *v, const struct RTCRayHit8 *ray, size_t n_rays, const met_packet *met,
                   hit_packet *hits) {
    const bool two_sided = v->mesh->two_sided;
    uint32_t piece[VISIBILITY_PACKET], lane[VISIBILITY_PACKET], found[VISIBILITY_PACKET];
    float u[VISIBILITY_PACKET], v_at[VISIBILITY_PACKET];
    size_t open = 0;
    for (size_t i = 0; i < n_rays; i++) {
        const bool back = met->facet[i] != VISIBILITY_NOTHING && met->cosine[i] >= 0;
        hits->distance[i] = ray->ray.tfar[i];
        hits->back[i] = back && !two_sided;
        hits->element[i] = VISIBILITY_NOTHING;
        if (met->facet[i] == VISIBILITY_NOTHING) continue;
        const primitive *p = &v->primitives[ray->hit.geomID[i]][ray->hit.primID[i]];
        hits->element[i] = p->element;
        if (p->element != MESH_NO_VERTEX) continue;
        piece[open] = p->piece;
        u[open] = ray->hit.u[i];
        v_at[open] = ray->hit.v[i];
        lane[open++] = (uint32_t)i;
    }
    if (open > 0) facet_grids_find(&v->grids, open, piece, u, v_at, found);
    for (size_t k = 0; k < open; k++) hits->element[lane[k]] = found[k];
    for (size_t i = 0; i < n_rays && two_sided; i++)
        if (met->facet[i] != VISIBILITY_NOTHING && met->cosine[i] >= 0)
            hits->element[i] += (uint32_t)v->n_fronts;
}

void visibility_cast(const visibility *v, const ray_packet *rays, size_t n_rays, const uint32_t *self,
                     unsigned how, hit_packet *hits) {
    const bool two_sided = v->mesh->two_sided;
    struct RTCRayHit8 ray __attribute__((aligned(32)));
    int active[VISIBILITY_PACKET] __attribute__((aligned(32)));
    met_packet met = {{0}, {0}};
    cast_context context = {.visibility = v, .cull_back = (how & VISIBILITY_CULL_BACK) != 0 && !two_sided};
    embree_query_init(&context.query);
    context.query.filter = refuse_own_and_culled;
    if ((how & VISIBILITY_TOGETHER) != 0) context.query.coherent = true;
    packet_set(&ray, rays);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        uint32_t own = self != NULL && i < n_rays ? self[i] : VISIBILITY_NOTHING;
        if (own != VISIBILITY_NOTHING && own >= v->n_fronts) own -= (uint32_t)v->n_fronts;
        ray.ray.id[i] = own == VISIBILITY_NOTHING ? own : v->facets.of_element[own];
        active[i] = i < n_rays ? -1 : 0;
    }
    if (self != NULL && !context.cull_back) {
        cast_lifted(v, rays, self, n_rays, &context, active, &ray, &met);
    } else {
        embree_intersect(active, v->scene, &context.query, &ray);
        facets_met(v, &ray, n_rays, &met);
    }

    bool backs = false;
    for (size_t i = 0; i < n_rays; i++) backs = backs || met.cosine[i] > 0;
    if (backs && !two_sided) {
        prefer_fronts(v, &met, &context, &ray);
        facets_met(v, &ray, n_rays, &met);
    }

    report(v, &ray, n_rays, &met, hits);
}

/* The same of lifted rays of which some have hit backs: a front in the same place counts in their stead. */
static void report_backs(const visibility *v, const uint32_t *facet, size_t n_rays, struct RTCRayHit8 *ray,
                         hit_packet *hits) {
    met_packet met = {{0}, {0}};
    cast_context context = {.visibility = v};
    embree_query_init(&context.query);
    context.query.filter = refuse_own_and_culled;
    for (size_t i = 0; i < VISIBILITY_PACKET; i++)
        ray->ray.id[i] = i < n_rays ? facet[i] : VISIBILITY_NOTHING;
    facets_met(v, ray, n_rays, &met);
    prefer_fronts(v, &met, &context, ray);
    facets_met(v, ray, n_rays, &met);
    report(v, ray, n_rays, &met, hits);
}

/* Hits on facets of many elements, which are found together. */
typedef struct open_hits {
    size_t n;
    uint32_t ray[FACET_SEARCHES], piece[FACET_SEARCHES];
    float u[FACET_SEARCHES], v[FACET_SEARCHES];
} open_hits;

static void find_elements(const visibility *v, open_hits *open, hit_packet *hits) {
    uint32_t found[FACET_SEARCHES];
    facet_grids_find(&v->grids, open->n, open->piece, open->u, open->v, found);
    for (size_t k = 0; k < open->n; k++) {
        hit_packet *const of = &hits[open->ray[k] / VISIBILITY_PACKET];
        const size_t lane = open->ray[k] % VISIBILITY_PACKET;
        of->element[lane] = found[k];
        if (v->mesh->two_sided && of->back[lane]) of->element[lane] += (uint32_t)v->n_fronts;
        of->back[lane] = of->back[lane] && !v->mesh->two_sided;
    }
    open->n = 0;
}

/* Packet p of lifted rays, its first n; those of its hits that are on facets of many elements are added. */
static void cast_packet(const visibility *v, const ray_packet *rays, size_t p, size_t n, const uint32_t *self,
                        const uint32_t *facet, hit_packet *hits, open_hits *open) {
    struct RTCRayHit8 ray __attribute__((aligned(32)));
    int active[VISIBILITY_PACKET] __attribute__((aligned(32)));
    embree_query query;
    size_t n_open = open->n;
    bool again = false, any_back = false;
    embree_query_init(&query);
    packet_set(&ray, rays);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) active[i] = i < n ? -1 : 0;
    embree_intersect(active, v->scene, &query, &ray);
    /* Without branches, which would be mispredicted at rays that leave: these take the first primitive. */
    for (size_t i = 0; i < n; i++) {
        const bool met = ray.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
        const primitive *of = &v->primitives[met ? ray.hit.geomID[i] : 0][met ? ray.hit.primID[i] : 0];
        const float cosine = of->normal[0] * ray.ray.dir_x[i] + of->normal[1] * ray.ray.dir_y[i] +
                             of->normal[2] * ray.ray.dir_z[i];
        const bool back = met & (cosine >= 0);
        again |= met & ((of->facet == facet[i]) | !(fabsf(cosine) * ray.ray.tfar[i] > v->rounding));
        any_back |= back;
        hits->distance[i] = ray.ray.tfar[i];
        hits->back[i] = back;
        hits->element[i] = met ? of->element : VISIBILITY_NOTHING;
        open->piece[n_open] = of->piece;
        open->u[n_open] = ray.hit.u[i];
        open->v[n_open] = ray.hit.v[i];
        open->ray[n_open] = (uint32_t)(p * VISIBILITY_PACKET + i);
        n_open += met & (of->element == MESH_NO_VERTEX);
    }
    if (again)
        visibility_cast(v, rays, n, self, 0, hits);
    else if (any_back && !v->mesh->two_sided)
        report_backs(v, facet, n, &ray, hits);
    else
        open->n = n_open;
    if (again || !any_back || !v->mesh->two_sided) return;
    for (size_t i = 0; i < n; i++) {
        if (!hits->back[i] || hits->element[i] == VISIBILITY_NOTHING) continue; /* or not found yet */
        hits->element[i] += (uint32_t)v->n_fronts;
        hits->back[i] = false;
    }
}

void visibility_cast_lifted(const visibility *v, const ray_packet *rays, size_t n_rays, const uint32_t *self,
                            const uint32_t *facet, hit_packet *hits) {
    open_hits open = {.n = 0};
    for (size_t j = 0; j < n_rays; j += VISIBILITY_PACKET) {
        const size_t p = j / VISIBILITY_PACKET,
                     n = n_rays - j < VISIBILITY_PACKET ? n_rays - j : VISIBILITY_PACKET;
        cast_packet(v, &rays[p], p, n, self + j, facet + j, &hits[p], &open);
        if (open.n > FACET_SEARCHES - VISIBILITY_PACKET) find_elements(v, &open, hits);
    }
    if (open.n > 0) find_elements(v, &open, hits);
}
