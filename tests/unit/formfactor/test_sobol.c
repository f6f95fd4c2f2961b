/* Sobol's sequence and the rays of an element that follow it: even to the last box, and less noisy than
 * chance. */
#include "solver/formfactor/visibility/sample.h"
#include "solver/formfactor/visibility/sobol.h"
#include "support/box.h"
#include "support/suite.h"

#include <math.h>

static lam_error error;

/* The degree s, the inner coefficients a and the initial numbers m of each dimension's primitive polynomial.
 */
typedef struct polynomial {
    unsigned s, a;
    uint32_t m[3];
} polynomial;

/* m_k = 2 a_1 m_(k-1) ^ ... ^ 2^(s-1) a_(s-1) m_(k-s+1) ^ 2^s m_(k-s) ^ m_(k-s), v_k = m_k 2^(31-k). */
START_TEST(directions_follow_their_polynomials) {
    static const polynomial of[SOBOL_DIMENSIONS] = {
        {0, 0, {0}}, {1, 0, {1}}, {2, 1, {1, 3}}, {3, 1, {1, 3, 1}}};
    for (int d = 0; d < SOBOL_DIMENSIONS; d++) {
        uint64_t m[SOBOL_BITS];
        for (unsigned k = 0; k < SOBOL_BITS; k++) {
            const unsigned s = of[d].s;
            m[k] = s == 0 ? 1 : k < s ? of[d].m[k] : m[k - s] ^ m[k - s] << s;
            for (unsigned q = 1; q < s && k >= s; q++)
                if (of[d].a >> (s - 1 - q) & 1) m[k] ^= m[k - q] << q;
            ck_assert_uint_eq(sobol_direction[d][k], (uint32_t)(m[k] << (31 - k)));
        }
    }
}
END_TEST

/* Any 2^K consecutive points from a multiple of 2^K on: every box of 2^-a_0 x ... x 2^-a_3, sum a = K - t,
 * has exactly 2^t of them, with t the sum of degrees less 1 of the polynomials (Sobol' 1967): 0 of the first
 * two dimensions, 3 of all four. */
static void check_boxes(int dimensions, unsigned t, uint32_t first) {
    enum { K = 9 };
    unsigned a[SOBOL_DIMENSIONS] = {0};
    const unsigned cuts = K - t;
    size_t shapes = 0;
    for (unsigned code = 0; code < 1u << 4 * dimensions; code++) {
        unsigned sum = 0;
        for (int d = 0; d < dimensions; d++) sum += a[d] = code >> 4 * d & 15;
        if (sum != cuts) continue;
        uint32_t count[1 << K] = {0};
        for (uint32_t k = 0; k < 1 << K; k++) {
            uint32_t box = 0;
            for (int d = 0; d < dimensions; d++)
                if (a[d] > 0) box = box << a[d] | sobol_coordinate(d, first + k) >> (32 - a[d]);
            count[box]++;
        }
        for (uint32_t box = 0; box < 1u << cuts; box++) ck_assert_uint_eq(count[box], 1u << t);
        shapes++;
    }
    ck_assert_uint_gt(shapes, cuts);
}

START_TEST(boxes_have_their_share) {
    const uint32_t firsts[3] = {0, 3 << 9, 0xABCDu << 9};
    check_boxes(2, 0, firsts[_i]);
    check_boxes(4, 3, firsts[_i]);
}
END_TEST

/* A closed cube with its visibility. */
typedef struct subject {
    mesh m;
    visibility *v;
} subject;

/* At its place: the visibility keeps the address of the mesh. */
static void make(unsigned divisions, subject *s) {
    const double size[3] = {1, 1, 1};
    s->m = box_mesh(size, divisions, .5f);
    ck_ok(visibility_create(&s->m, &s->v, &error));
}

static void destroy(subject *s) {
    visibility_destroy(s->v);
    mesh_free(&s->m);
}

/* The coordinates u, w of the origins in a parallelogram, whose place is known to 2^-22 in single precision,
 * in units of 2^-10. */
static void origins_of(const element_sampler *s, const ray_packet *rays, uint32_t at[2][VISIBILITY_PACKET]) {
    ck_assert(s->parallelogram);
    for (int k = 0; k < VISIBILITY_PACKET; k++)
        for (int e = 0; e < 2; e++) {
            double along = 0, length2 = 0;
            for (int d = 0; d < 3; d++) {
                const double side = (double)s->edge[0][e][d];
                along += side * ((double)rays->origin[d][k] - (double)s->corner[0][d]);
                length2 += side * side;
            }
            at[e][k] = (uint32_t)(along / length2 * 1024);
        }
}

/* Rays of any eight indices are those of the sequence, whatever else is in the packet: up to one shift by
 * exclusive or. Their origins take its last two dimensions. */
START_TEST(packets_follow_the_sequence) {
    static const uint32_t indices[2][VISIBILITY_PACKET] = {
        {(1 << 23) + 77, 31, 32, 1023, 1024, 5000, 70000, 0}, {1023, 1024, 1025, 1, 1100, 2, 3, 4}};
    const uint32_t *const index = indices[_i];
    subject s;
    make(1, &s);
    for (size_t element = 0; element < s.m.n; element++) {
        element_sampler sampler;
        ray_packet mixed, alone;
        uint32_t at[2][VISIBILITY_PACKET];
        element_sampler_init(&sampler, &s.m, s.v, element, 4);
        element_sampler_packet_of(&sampler, index, &mixed);
        origins_of(&sampler, &mixed, at);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            uint32_t same[VISIBILITY_PACKET];
            for (int l = 0; l < VISIBILITY_PACKET; l++) same[l] = index[k];
            element_sampler_packet_of(&sampler, same, &alone);
            for (int d = 0; d < 3; d++) {
                ck_assert_float_eq(mixed.origin[d][k], alone.origin[d][k]);
                ck_assert_float_eq(mixed.direction[d][k], alone.direction[d][k]);
            }
            for (int e = 0; e < 2; e++)
                ck_assert_uint_eq(at[e][k] ^ at[e][0], sobol_coordinate(2 + e, index[k] ^ index[0]) >> 22);
        }
    }
    destroy(&s);
}
END_TEST

/* A shift is uniform and independent in all four coordinates: of the first rays of TRIES seeds a sixteenth
 * each begins in one of the boxes that halve every axis, to five standard deviations of a count by chance.
 * The halves of the direction's square are those of the disc (Shirley and Chiu 1997): x < 0 and y < 0. */
START_TEST(shifts_are_uniform) {
    enum { TRIES = 4096, BOXES = 16 };
    subject s;
    make(1, &s);
    size_t count[BOXES] = {0};
    const uint32_t first[VISIBILITY_PACKET] = {0};
    for (uint64_t seed = 0; seed < TRIES; seed++) {
        element_sampler sampler;
        ray_packet rays;
        uint32_t at[2][VISIBILITY_PACKET];
        float x = 0, y = 0;
        element_sampler_init(&sampler, &s.m, s.v, 2, seed);
        element_sampler_packet_of(&sampler, first, &rays);
        origins_of(&sampler, &rays, at);
        for (int d = 0; d < 3; d++) {
            x += rays.direction[d][0] * sampler.frame.tangent[d];
            y += rays.direction[d][0] * sampler.frame.bitangent[d];
        }
        count[(at[0][0] >= 512) + 2 * (at[1][0] >= 512) + 4 * (x > 0) + 8 * (y > 0)]++;
    }
    const double each = (double)TRIES / BOXES, deviation = sqrt(each * (1 - 1. / BOXES));
    for (int b = 0; b < BOXES; b++) ck_assert_double_eq_tol((double)count[b], each, 5 * deviation);
    destroy(&s);
}
END_TEST

/* Directions take the first two dimensions: 256 rays from a multiple of 256 on have one in each cell of 16 x
 * 16 of the square that directions are made of, so that in their order each packet of eight has the cells of
 * half a row of the Morton order, all of one quarter of a quarter of the disc: x and y of one sign. */
START_TEST(directions_fill_the_disc) {
    enum { RAYS = 256 };
    subject s;
    make(1, &s);
    element_sampler sampler;
    element_sampler_init(&sampler, &s.m, s.v, 3, 8);
    const element_frame *f = &sampler.frame;
    uint32_t order[SAMPLE_ORDERED];
    element_sampler_order(&sampler, 5 * RAYS, RAYS, order);
    size_t quarter[4] = {0};
    for (size_t first = 0; first < RAYS; first += VISIBILITY_PACKET) {
        ray_packet rays;
        element_sampler_packet_of(&sampler, order + first, &rays);
        int of_packet = -1;
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            float x = 0, y = 0;
            for (int d = 0; d < 3; d++) {
                x += rays.direction[d][k] * f->tangent[d];
                y += rays.direction[d][k] * f->bitangent[d];
            }
            const int at = (x > 0) + 2 * (y > 0);
            if (of_packet < 0) of_packet = at;
            ck_assert_int_eq(at, of_packet);
            quarter[at]++;
        }
    }
    for (int q = 0; q < 4; q++) ck_assert_uint_eq(quarter[q], RAYS / 4);
    destroy(&s);
}
END_TEST

/* The variance of a net's estimate of a volume with a smooth surface is about N^(-1-1/d) V (1 - V) in d
 * dimensions (He and Wang 2015), here 1024^(-1/4) = .18 of that of independent rays. Twice that is allowed
 * for what the constant may be; the mean over 54 x 53 pairs and SEEDS seeds has hardly any noise of its own.
 * (A Kronecker sequence of the generalised golden ratio has .6 there, as its points lie in few planes.) */
START_TEST(rays_are_less_noisy_than_chance) {
    enum { DIVISIONS = 3, RAYS = 1024, SEEDS = 4 };
    const double size[3] = {1, 1, 1};
    subject s;
    make(DIVISIONS, &s);
    double squared = 0, by_chance = 0;
    for (size_t i = 0; i < s.m.n; i++) {
        const box_cell from = box_cell_of(size, DIVISIONS, i);
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            size_t count[6 * DIVISIONS * DIVISIONS] = {0};
            element_sampler sampler;
            element_sampler_init(&sampler, &s.m, s.v, i, seed);
            for (uint32_t first = 0; first < RAYS; first += VISIBILITY_PACKET) {
                uint32_t self[VISIBILITY_PACKET];
                ray_packet rays;
                hit_packet hits;
                for (int k = 0; k < VISIBILITY_PACKET; k++) self[k] = (uint32_t)i;
                element_sampler_packet(&sampler, first, &rays);
                visibility_cast(s.v, &rays, VISIBILITY_PACKET, self, 0, &hits);
                for (int k = 0; k < VISIBILITY_PACKET; k++)
                    if (hits.element[k] != VISIBILITY_NOTHING) count[hits.element[k]]++;
            }
            for (size_t j = 0; j < s.m.n; j++) {
                if (i / (DIVISIONS * DIVISIONS) == j / (DIVISIONS * DIVISIONS)) continue;
                const box_cell to = box_cell_of(size, DIVISIONS, j);
                const double F = box_exchange(&from, &to) / s.m.area[i], off = (double)count[j] / RAYS - F;
                squared += off * off;
                by_chance += F * (1 - F) / RAYS;
            }
        }
    }
    ck_assert_double_gt(squared, 0);
    ck_assert_double_lt(squared / by_chance, .36);
    destroy(&s);
}
END_TEST

/* The map of the square to a triangle preserves area: of SIDE^2 places of a grid a quarter lies in each of
 * the four triangles that its middle lines make, but for cells that their six edges cross. It is continuous:
 * neighbours in the grid stay within 1.5 steps of the longer side. */
START_TEST(triangles_keep_area_and_neighbours) {
    enum { SIDE = 64 };
    const element_sampler s = {.edge = {{{3, 0, 0}, {0, 2, 0}}}, .first_share = 1};
    size_t count[4] = {0};
    for (int i = 0; i < SIDE; i++)
        for (int j = 0; j < SIDE; j++) {
            const float u = ((float)i + .5f) / SIDE, w = ((float)j + .5f) / SIDE, step = 1.f / SIDE;
            float p[3], beside[3];
            element_sampler_point(&s, u, w, p);
            const float x = p[0] / 3, y = p[1] / 2;
            ck_assert(x >= 0 && y >= 0 && x + y <= 1);
            count[x + y < .5f ? 0 : x > .5f ? 1 : y > .5f ? 2 : 3]++;
            for (int side = 0; side < 2; side++) {
                const float shifted[2] = {u + (side == 0 ? step : 0), w + (side == 0 ? 0 : step)};
                if (shifted[side] >= 1) continue;
                element_sampler_point(&s, shifted[0], shifted[1], beside);
                ck_assert_float_le(fabsf(beside[0] - p[0]), 1.5f * 3 * step);
                ck_assert_float_le(fabsf(beside[1] - p[1]), 1.5f * 3 * step);
            }
        }
    for (int q = 0; q < 4; q++) ck_assert_int_le(abs((int)count[q] - SIDE * SIDE / 4), 6 * SIDE);
    for (int corner = 1; corner < 4; corner++) { /* places that single precision rounds to 1 */
        float p[3];
        element_sampler_point(&s, (float)(corner & 1), (float)(corner >> 1), p);
        ck_assert(p[0] >= 0 && p[1] >= 0 && p[0] / 3 + p[1] / 2 <= 1 + 1e-6f);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sobol");
    TCase *cases = tcase_create("sobol");
    tcase_add_test(cases, directions_follow_their_polynomials);
    tcase_add_loop_test(cases, boxes_have_their_share, 0, 3);
    tcase_add_loop_test(cases, packets_follow_the_sequence, 0, 2);
    tcase_add_test(cases, shifts_are_uniform);
    tcase_add_test(cases, directions_fill_the_disc);
    tcase_add_test(cases, rays_are_less_noisy_than_chance);
    tcase_add_test(cases, triangles_keep_area_and_neighbours);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
