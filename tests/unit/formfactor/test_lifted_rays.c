/* Rays that start above their element, as walks cast them, against the same ones cast from its plane. */
#include "solver/base/random.h"
#include "solver/formfactor/visibility/visibility.h"
#include "support/box.h"
#include "support/suite.h"

enum { STREAMS = 256, PACKETS = 20, DIVISIONS = 3 };

/* A cube from inside, with a plate whose back is seen and a sheet of two faces in one place. */
static mesh cube_with_plates(void) {
    static const double size[3] = {1, 1, 1};
    static const box_cell plate = {.axis = 0, .level = .7, .from = {.7, .1, .1}, .to = {.7, .6, .9}};
    static const box_cell sheet = {.axis = 2, .level = .4, .from = {.1, .2, .4}, .to = {.5, .9, .4}};
    mesh m = {0};
    for (size_t i = 0; i < (size_t)6 * DIVISIONS * DIVISIONS; i++) {
        const box_cell cell = box_cell_of(size, DIVISIONS, i);
        mesh_add_cell(&m, &cell, cell.level < .5);
    }
    mesh_add_cell(&m, &plate, true);
    mesh_add_cell(&m, &sheet, true);
    mesh_add_cell(&m, &sheet, false);
    mesh_finish(&m, .5f);
    return m;
}

/* A ray from a random point of a random element into the half space before it. */
static void set_ray(const mesh *m, const visibility *v, uint64_t *random, ray_packet *rays, size_t lane,
                    uint32_t *self) {
    const size_t i = (size_t)(random_unit(random) * (double)m->n);
    const double a = random_unit(random), b = random_unit(random);
    const double *corner[4];
    double at[3], towards = 0;
    float origin[3], direction[3];
    for (int c = 0; c < 4; c++) corner[c] = m->vertices[m->elements[i][c]];
    for (int d = 0; d < 3; d++) {
        at[d] = corner[0][d] + a * (corner[1][d] - corner[0][d]) + b * (corner[3][d] - corner[0][d]);
        direction[d] = (float)random_between(random, -1, 1);
        towards += (double)(direction[d] * m->normal[i][d]);
    }
    visibility_recentre(v, at, origin);
    for (int d = 0; d < 3; d++) {
        rays->origin[d][lane] = origin[d];
        rays->direction[d][lane] = towards < 0 ? -direction[d] : direction[d];
    }
    *self = (uint32_t)i;
}

/* Rays along an edge of an element may meet its neighbour: there are fewer than one in a thousand. */
START_TEST(lifted_rays_meet_the_same) {
    mesh m = cube_with_plates();
    visibility *v = NULL;
    lam_error error = {.message = ""};
    uint64_t random = 1;
    size_t all = 0, backs = 0, others = 0;
    ck_ok(visibility_create(&m, &v, &error));
    const float height = 2 * (float)visibility_rounding(v);
    for (size_t stream = 0; stream < STREAMS; stream++) {
        const size_t n = 1 + stream % (PACKETS * VISIBILITY_PACKET);
        ray_packet rays[PACKETS];
        hit_packet plain[PACKETS], lifted[PACKETS];
        uint32_t self[PACKETS * VISIBILITY_PACKET], facet[PACKETS * VISIBILITY_PACKET];
        for (size_t i = 0; i < (size_t)PACKETS * VISIBILITY_PACKET; i++) {
            set_ray(&m, v, &random, &rays[i / VISIBILITY_PACKET], i % VISIBILITY_PACKET, &self[i]);
            facet[i] = visibility_facets(v)->of_element[self[i]];
        }
        for (size_t i = 0; i < n; i += VISIBILITY_PACKET) {
            const size_t p = i / VISIBILITY_PACKET, left = n - i;
            visibility_cast(v, &rays[p], left < VISIBILITY_PACKET ? left : VISIBILITY_PACKET, self + i, 0,
                            &plain[p]);
        }
        for (size_t i = 0; i < (size_t)PACKETS * VISIBILITY_PACKET; i++)
            for (int d = 0; d < 3; d++)
                rays[i / VISIBILITY_PACKET].origin[d][i % VISIBILITY_PACKET] += height * m.normal[self[i]][d];
        visibility_cast_lifted(v, rays, n, self, facet, lifted);
        for (size_t i = 0; i < n; i++) {
            const hit_packet *a = &plain[i / VISIBILITY_PACKET], *b = &lifted[i / VISIBILITY_PACKET];
            const size_t lane = i % VISIBILITY_PACKET;
            const bool same = a->element[lane] == b->element[lane] && a->back[lane] == b->back[lane];
            const double far = (double)a->distance[lane];
            all++;
            backs += b->back[lane];
            others += !same;
            if (same) ck_assert_double_eq_tol((double)b->distance[lane], far, 1e-4 * far + 1e-5);
        }
    }
    ck_assert_uint_gt(backs, all / 50);
    ck_assert_msg(others * 1000 < all, "%zu of %zu differ", others, all);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("lifted_rays");
    TCase *tests = tcase_create("lifted_rays");
    tcase_add_test(tests, lifted_rays_meet_the_same);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
