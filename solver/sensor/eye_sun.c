#include "solver/sensor/eye_sun.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/visibility/pane_path.h"

#include <stdlib.h>

/* Metres from the eye to where its ray begins. */
static const double before = 1e-3;

struct eye_sun {
    const mesh *m;
    visibility *v;
};

lam_status eye_sun_create(const mesh *m, eye_sun **out, lam_error *error) {
    lam_status status = LAM_OK;
    eye_sun *s = memory_allocate(1, sizeof *s, "eyes", error);
    if (s == NULL) return LAM_ERR_MEMORY;
    s->m = m;
    TRY(visibility_create(m, &s->v, error));
    *out = s;
    s = NULL;
done:
    free(s);
    return status;
}

void eye_sun_free(eye_sun *s) {
    if (s == NULL) return;
    visibility_destroy(s->v);
    free(s);
}

bool eye_sun_is_seen(const eye_sun *s, const double at[3], const double view[3], const double towards[3]) {
    static const uint32_t self[VISIBILITY_PACKET] = {VISIBILITY_NOTHING};
    double from[3], passed[VISIBILITY_PACKET] = {1};
    float origin[3];
    ray_packet rays = {.origin = {{0}}};
    hit_packet hits;
    if (!(dot3(view, towards) > 0)) return false;
    for (int d = 0; d < 3; d++) from[d] = at[d] + before * view[d];
    visibility_recentre(s->v, from, origin);
    for (int d = 0; d < 3; d++) {
        rays.origin[d][0] = origin[d];
        rays.direction[d][0] = (float)towards[d];
    }
    visibility_cast(s->v, &rays, 1, self, 0, &hits);
    if (s->m->glass != NULL) pane_path_follow(s->v, s->m, &rays, 1, &hits, passed, NULL);
    return hits.element[0] == VISIBILITY_NOTHING && passed[0] > 0;
}
