/* The rays of an element in the order of their directions: the same rays, and the same elements met. */
#include "solver/formfactor/rays/rays.h"
#include "support/building.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"

#include <stdlib.h>
#include <string.h>

static lam_error error;

static mesh scene_of(const char *kind) {
    const generate_options how = {
        .kind = kind, .variant = 1, .terrain = "flat", .elements = 800, .seed = 2, .reflectance = -1};
    return generate_good(&how);
}

/* Each ray once, also where they are no whole packets and do not begin at the first. */
START_TEST(every_ray_is_there_once) {
    const size_t counts[4] = {SAMPLE_ORDERED, 1, 77, 512};
    const uint32_t first = _i == 0 ? 0 : 1024;
    mesh m = scene_of("canopy");
    visibility *v = NULL;
    element_sampler s;
    ck_ok(visibility_create(&m, &v, &error));
    element_sampler_init(&s, &m, v, 5, 9);
    uint32_t order[SAMPLE_ORDERED];
    bool seen[SAMPLE_ORDERED] = {false};
    element_sampler_order(&s, first, counts[_i], order);
    for (size_t k = 0; k < counts[_i]; k++) {
        ck_assert_uint_ge(order[k], first);
        ck_assert_uint_lt(order[k], first + counts[_i]);
        ck_assert(!seen[order[k] - first]);
        seen[order[k] - first] = true;
    }
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* The mean cosine between a packet's first direction and its others. */
static double likeness(const element_sampler *s, const uint32_t *order, size_t count) {
    double sum = 0;
    for (size_t first = 0; first < count; first += VISIBILITY_PACKET) {
        ray_packet rays;
        element_sampler_packet_of(s, order + first, &rays);
        for (int k = 1; k < VISIBILITY_PACKET; k++)
            for (int d = 0; d < 3; d++) sum += (double)(rays.direction[d][0] * rays.direction[d][k]);
    }
    return sum / (double)(count / VISIBILITY_PACKET * (VISIBILITY_PACKET - 1));
}

/* A packet of 8 of 1,024 rays fills two cells of 256: directions about 1/8 apart on the disc, whose cosine is
 * above 1 - (1/8)^2 but near the horizon. In the order of the sequence they are spread over the hemisphere:
 * the mean cosine of two cosine-distributed directions is (2/3)^2. */
START_TEST(packets_have_similar_directions) {
    mesh m = scene_of("canopy");
    visibility *v = NULL;
    element_sampler s;
    uint32_t order[SAMPLE_ORDERED], plain[SAMPLE_ORDERED];
    ck_ok(visibility_create(&m, &v, &error));
    element_sampler_init(&s, &m, v, 5, 9);
    element_sampler_order(&s, 0, SAMPLE_ORDERED, order);
    for (uint32_t k = 0; k < SAMPLE_ORDERED; k++) plain[k] = k;
    ck_assert_double_gt(likeness(&s, order, SAMPLE_ORDERED), .95);
    ck_assert_double_lt(likeness(&s, plain, SAMPLE_ORDERED), .6);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* Counts of the elements that the rays of one element meet, ray by ray, each cast alone and in the order of
 * the sequence: the plain meaning of rays_meet. */
static void count_alone(const ray_context *c, const element_sampler *s, uint32_t element, uint32_t first,
                        uint32_t last, size_t *counts, ray_tally *tally) {
    for (uint32_t ray = first; ray < last; ray++) {
        uint32_t index[VISIBILITY_PACKET], self[VISIBILITY_PACKET];
        ray_packet rays;
        hit_packet hits;
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            index[k] = ray;
            self[k] = element;
        }
        element_sampler_packet_of(s, index, &rays);
        visibility_cast(c->v, &rays, 1, self, 0, &hits);
        if (hits.element[0] == VISIBILITY_NOTHING)
            tally->left++;
        else if (hits.back[0])
            tally->lost++;
        else
            counts[hits.element[0]]++;
    }
}

START_TEST(rays_meet_what_they_meet_alone) {
    const char *const kinds[3] = {"canopy", "city", "cornell"};
    mesh m = scene_of(kinds[_i]);
    visibility *v = NULL;
    ck_ok(visibility_create(&m, &v, &error));
    const ray_context c = {.m = &m, .v = v, .seed = 9};
    size_t *alone = test_allocate(m.n, sizeof *alone), *together = test_allocate(m.n, sizeof *together);
    size_t hit = 0;
    for (uint32_t element = 0; element < m.n; element += 7) {
        const uint32_t first = 64, last = 64 + 333;
        uint32_t met[RAYS_AT_ONCE];
        element_sampler s;
        ray_tally one = {0}, other = {0};
        memset(alone, 0, m.n * sizeof *alone);
        memset(together, 0, m.n * sizeof *together);
        element_sampler_init(&s, &m, v, element, c.seed);
        count_alone(&c, &s, element, first, last, alone, &one);
        const size_t count = rays_meet(&c, &s, element, first, last, met, &other, NULL);
        for (size_t k = 0; k < count; k++) together[met[k]]++;
        for (size_t j = 0; j < m.n; j++) ck_assert_uint_eq(alone[j], together[j]);
        ck_assert_uint_eq(one.left, other.left);
        ck_assert_uint_eq(one.lost, other.lost);
        ck_assert_uint_eq(count + one.left + one.lost, last - first);
        hit += count;
    }
    ck_assert_uint_gt(hit, 1000);
    free(alone);
    free(together);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("ray_order");
    TCase *cases = tcase_create("ray_order");
    tcase_add_loop_test(cases, every_ray_is_there_once, 0, 4);
    tcase_add_test(cases, packets_have_similar_directions);
    tcase_add_loop_test(cases, rays_meet_what_they_meet_alone, 0, 3);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
