#include "solver/formfactor/visibility.h"

#include <embree3/rtcore.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Triangles and quads are two geometries; prim_element leads from (geometry, primitive) to the element. */
enum { TRIANGLES, QUADS, N_GEOMETRIES };

struct visibility {
    RTCDevice device;
    RTCScene scene;
    const mesh *mesh;
    size_t n_fronts; /* elements in the scene: n, or n/2 when two-sided */
    uint32_t *prim_element[N_GEOMETRIES];
    double centre[3];
};

static lam_status device_error(const visibility *v, const char *what, lam_error *error) {
    enum RTCError code = rtcGetDeviceError(v->device);
    if (code == RTC_ERROR_OUT_OF_MEMORY)
        return status_fail(error, LAM_ERR_MEMORY, "Embree: %s: out of memory; use a smaller scene", what);
    return status_fail(error, LAM_ERR_INTERNAL, "Embree: %s: error %d", what, (int)code);
}

static bool is_triangle(const mesh *m, size_t element) {
    return m->elements[element][3] == MESH_NO_VERTEX;
}

/* Adds the triangles or the quads among the fronts as one geometry with its own copy of the vertices. */
static lam_status add_geometry(visibility *v, int kind, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = v->mesh;
    const unsigned corners = kind == TRIANGLES ? 3 : 4;
    RTCGeometry geometry = NULL;
    size_t count = 0;
    for (size_t i = 0; i < v->n_fronts; i++) count += is_triangle(m, i) == (kind == TRIANGLES);
    if (count == 0) goto done;

    v->prim_element[kind] = memory_allocate(count, sizeof(uint32_t), "visibility", error);
    if (v->prim_element[kind] == NULL) return LAM_ERR_MEMORY;
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
    for (size_t i = 0; i < v->n_fronts; i++) {
        if (is_triangle(m, i) != (kind == TRIANGLES)) continue;
        for (unsigned c = 0; c < corners; c++) indices[prim * corners + c] = m->elements[i][c];
        v->prim_element[kind][prim++] = (uint32_t)i;
    }
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(v->scene, geometry, (unsigned)kind);
done:
    if (geometry != NULL) rtcReleaseGeometry(geometry);
    return status;
}

lam_status visibility_create(const mesh *m, visibility **out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = memory_allocate(1, sizeof *v, "visibility", error);
    if (v == NULL) return LAM_ERR_MEMORY;
    v->mesh = m;
    v->n_fronts = m->two_sided ? m->n / 2 : m->n;
    double radius;
    mesh_bounds(m, v->centre, &radius);

    /* One thread: the hierarchy is built in a fraction of a second and rays bring their own threads. */
    v->device = rtcNewDevice("threads=1,user_threads=0,set_affinity=0");
    if (v->device == NULL) FAIL(error, LAM_ERR_INTERNAL, "Embree: cannot make a device");
    v->scene = rtcNewScene(v->device);
    if (v->scene == NULL) TRY(device_error(v, "new scene", error));
    rtcSetSceneFlags(v->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(v->scene, RTC_BUILD_QUALITY_HIGH);
    TRY(add_geometry(v, TRIANGLES, error));
    TRY(add_geometry(v, QUADS, error));
    rtcCommitScene(v->scene);
    if (rtcGetDeviceError(v->device) != RTC_ERROR_NONE)
        FAIL(error, LAM_ERR_INTERNAL, "Embree: cannot build the scene of %zu elements", m->n);
    *out = v;
    v = NULL;
done:
    visibility_destroy(v);
    return status;
}

void visibility_destroy(visibility *v) {
    if (v == NULL) return;
    if (v->scene != NULL) rtcReleaseScene(v->scene);
    if (v->device != NULL) rtcReleaseDevice(v->device);
    for (int kind = 0; kind < N_GEOMETRIES; kind++) free(v->prim_element[kind]);
    free(v);
}

void visibility_recentre(const visibility *v, const double point[3], float recentred[3]) {
    for (int d = 0; d < 3; d++) recentred[d] = (float)(point[d] - v->centre[d]);
}

void visibility_cast(const visibility *v, const ray_packet *rays, size_t n_rays, const uint32_t *self,
                     bool cull_back, hit_packet *hits) {
    struct RTCRayHit8 ray __attribute__((aligned(32)));
    int active[VISIBILITY_PACKET] __attribute__((aligned(32)));
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);

    memcpy(ray.ray.org_x, rays->origin[0], sizeof rays->origin[0]);
    memcpy(ray.ray.org_y, rays->origin[1], sizeof rays->origin[1]);
    memcpy(ray.ray.org_z, rays->origin[2], sizeof rays->origin[2]);
    memcpy(ray.ray.dir_x, rays->direction[0], sizeof rays->direction[0]);
    memcpy(ray.ray.dir_y, rays->direction[1], sizeof rays->direction[1]);
    memcpy(ray.ray.dir_z, rays->direction[2], sizeof rays->direction[2]);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        active[i] = i < n_rays ? -1 : 0;
        ray.ray.tnear[i] = 0;
        ray.ray.tfar[i] = INFINITY;
        ray.ray.time[i] = 0;
        ray.ray.mask[i] = 0xFFFFFFFFu;
        ray.ray.id[i] = (unsigned)i;
        ray.ray.flags[i] = 0;
        ray.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        ray.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }

    bool again = true;
    while (again) {
        rtcIntersect8(active, v->scene, &context, &ray);
        again = false;
        for (size_t i = 0; i < n_rays; i++) {
            if (!active[i]) continue;
            active[i] = 0;
            if (ray.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
                hits->element[i] = VISIBILITY_NOTHING;
                hits->back[i] = false;
                hits->distance[i] = INFINITY;
                continue;
            }
            const uint32_t front = v->prim_element[ray.hit.geomID[i]][ray.hit.primID[i]];
            const float *normal = v->mesh->normal[front];
            bool back = normal[0] * rays->direction[0][i] + normal[1] * rays->direction[1][i] +
                            normal[2] * rays->direction[2][i] >=
                        0;
            uint32_t own = self != NULL ? self[i] : VISIBILITY_NOTHING;
            if (own != VISIBILITY_NOTHING && own >= v->n_fronts) own -= (uint32_t)v->n_fronts;
            if (front == own || (back && cull_back && !v->mesh->two_sided)) {
                /* Go on behind what does not count. */
                ray.ray.tnear[i] = nextafterf(ray.ray.tfar[i], INFINITY);
                ray.ray.tfar[i] = INFINITY;
                ray.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
                active[i] = -1;
                again = true;
                continue;
            }
            hits->element[i] = front;
            hits->distance[i] = ray.ray.tfar[i];
            hits->back[i] = back;
            if (back && v->mesh->two_sided) {
                hits->element[i] = front + (uint32_t)v->n_fronts;
                hits->back[i] = false;
            }
        }
    }
}
