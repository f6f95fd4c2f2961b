/* Weights of receivers: their integrals over all directions and over those below a horizon, by quadrature. */
#include "solver/base/receiver_weight.h"

#include "solver/base/vector3.h"
#include "support/suite.h"

#include <math.h>

enum { HEIGHTS = 200, TURNS = 400 };

/* The integrals of the density over all directions, and over those below the horizon of z. */
static void integrate(const placed_receiver *r, double *all, double *below) {
    *all = *below = 0;
    for (int i = 0; i < HEIGHTS; i++)
        for (int k = 0; k < TURNS; k++) {
            const double z = (2 * i + 1.) / HEIGHTS - 1, flat = sqrt(1 - z * z),
                         turn = 2 * M_PI * (k + .5) / TURNS;
            const double direction[3] = {flat * cos(turn), flat * sin(turn), z};
            const double part =
                receiver_weight_density(r->kind, r->axis, r->look, direction) * 4 * M_PI / (HEIGHTS * TURNS);
            *all += part;
            if (z < 0) *below += part;
        }
}

/* Midpoints of 80,000 cells leave some 1e-4 where a density has an edge. */
START_TEST(integrals) {
    static const double up[3] = {0, 0, 1},
                        axes[][3] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {.6, 0, .8}, {0, .8, -.6}};
    for (unsigned kind = 0; kind < 4; kind++)
        for (size_t k = 0; k < sizeof axes / sizeof axes[0]; k++) {
            static const double across[] = {0, 1, 0}, other[] = {1, 0, 0};
            placed_receiver r = {.kind = kind};
            double all, below;
            for (int d = 0; d < 3 && kind < 3; d++) r.axis[d] = axes[k][d];
            for (int d = 0; d < 3 && kind == 2; d++) r.look[d] = (k < 4 ? across : other)[d];
            if (kind == 2 && k == 3) cross3(across, r.axis, r.look); /* tilted, it looks down or up */
            integrate(&r, &all, &below);
            ck_assert_double_eq_tol(all, 1, 3e-4);
            ck_assert_double_eq_tol(below, receiver_weight_below(&r, up), 3e-4);
        }
}
END_TEST

int main(void) {
    Suite *s = suite_create("receiver_weight");
    TCase *c = tcase_create("all");
    tcase_add_test(c, integrals);
    suite_add_tcase(s, c);
    return suite_run(s);
}
