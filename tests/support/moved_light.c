#include "support/moved_light.h"

#include "support/dense.h"
#include "support/scene.h"

const double light_box[3] = {1, 1, 1};

moving_light light_square(void) {
    static const double corners[4][3] = {{0, 0, 0}, {0, .25, 0}, {.25, .25, 0}, {.25, 0, 0}};
    static const double moves[LIGHT_POSITIONS][3] = {
        {.25, .25, .75}, {.375, .25, .75}, {.6, .5, .75}, {.25, .5, .3}};
    moving_light l;
    lam_error error = {.message = ""};
    double(*corner)[3] = test_allocate(4, sizeof *corner);
    memcpy(corner, corners, sizeof corners);
    ck_ok(moving_light_create(4, corner, &l, &error));
    l.n = LIGHT_POSITIONS;
    l.pose = test_allocate(LIGHT_POSITIONS, sizeof *l.pose);
    l.emission[0] = 3;
    for (size_t k = 0; k < LIGHT_POSITIONS; k++) {
        l.pose[k].name = strdup("a position");
        for (int d = 0; d < 3; d++) {
            l.pose[k].move[d] = moves[k][d];
            l.pose[k].turn[d][d] = 1;
        }
    }
    /* Turned about y: (x, y, z) becomes (-z, y, x), and what looks down looks along x. */
    static const double about_y[3][3] = {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}};
    memcpy(l.pose[3].turn, about_y, sizeof about_y);
    return l;
}

mesh light_cornell(void) {
    const generate_options how = {.kind = "cornell", .elements = 150, .reflectance = .5, .seed = 1};
    return generate_good(&how);
}

/* The pose at these parts of the way from low to high, turned about y. */
static void set_pose(light_pose *p, double angle, const double part[3], const double low[3],
                     const double high[3]) {
    const double turn[3][3] = {{cos(angle), 0, -sin(angle)}, {0, 1, 0}, {sin(angle), 0, cos(angle)}};
    memcpy(p->turn, turn, sizeof turn);
    for (int d = 0; d < 3; d++) p->move[d] = low[d] + part[d] * (high[d] - low[d]);
}

moving_light light_falling(const mesh *m) {
    moving_light l = light_square();
    double low[3], high[3];
    mesh_box(m, low, high);
    for (size_t k = 0; k < l.n; k++) {
        const double part[3] = {.5, .5, .9 - .2 * (double)k};
        set_pose(&l.pose[k], .4 * (double)k, part, low, high);
    }
    for (int c = 0; c < MOVING_LIGHT_CHANNELS; c++) l.emission[c] = 1;
    return l;
}

moving_light light_curved(const mesh *m) {
    enum { CURVE = 16 };
    moving_light l = light_square();
    double low[3], high[3];
    mesh_box(m, low, high);
    for (size_t k = 0; k < l.n; k++) free(l.pose[k].name);
    free(l.pose);
    l.n = CURVE;
    l.pose = test_allocate(CURVE, sizeof *l.pose);
    for (size_t k = 0; k < CURVE; k++) {
        const double a = M_PI * (double)k / (CURVE - 1);
        const double part[3] = {.5 - .3 * cos(a), .5, .6 + .25 * sin(a)};
        l.pose[k].name = strdup("a position");
        set_pose(&l.pose[k], .5 * (a - M_PI / 2), part, low, high);
    }
    for (int c = 0; c < MOVING_LIGHT_CHANNELS; c++) l.emission[c] = 1;
    return l;
}

reuse_estimates reuse_solve(const mesh *m, const reuse_problem *problem) {
    walk_scene *s = NULL;
    reuse_estimates e;
    lam_error error = {.message = ""};
    ck_ok(walk_scene_create(m, CLOSURE_MEASURED, &s, &error));
    ck_ok(walk_reuse(s, problem, &e, &error));
    walk_scene_free(s);
    return e;
}

reuse_estimates reuse_by(const mesh *m, const moving_light *l, reuse_way way, size_t paths, size_t resolution,
                         uint64_t seed) {
    const reuse_problem problem = {
        .light = l, .way = way, .paths = paths, .resolution = resolution, .seed = seed};
    return reuse_solve(m, &problem);
}
