#include "solver/base/harmonics.h"

#include "solver/base/vector3.h"

#include <math.h>

/* sqrt(1 / 4 pi), sqrt(3 / 4 pi), sqrt(15 / 4 pi), sqrt(5 / 16 pi) and sqrt(15 / 16 pi) */
static const double c0 = .28209479177387814, c1 = .48860251190291992, c_xy = 1.0925484305920792,
                    c_zz = .31539156525252005, c_xx = .54627421529603959;

/* Y of sums of 1, of directions w and of their products w w^T. */
static void combine(double one, const double w[3], const double ww[3][3], double Y[HARMONICS]) {
    Y[0] = c0 * one;
    Y[1] = c1 * w[1];
    Y[2] = c1 * w[2];
    Y[3] = c1 * w[0];
    Y[4] = c_xy * ww[0][1];
    Y[5] = c_xy * ww[1][2];
    Y[6] = c_zz * (3 * ww[2][2] - one);
    Y[7] = c_xy * ww[0][2];
    Y[8] = c_xx * (ww[0][0] - ww[1][1]);
}

void harmonics_at(const double direction[3], double Y[HARMONICS]) {
    double ww[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) ww[i][j] = direction[i] * direction[j];
    combine(1, direction, ww, Y);
}

void harmonics_turn(const double axis[3], const double look[3], const double v[3], double out[3]) {
    double across[3];
    cross3(axis, look, across);
    out[0] = dot3(v, look);
    out[1] = dot3(v, across);
    out[2] = dot3(v, axis);
}

/* With the outward normal m of an edge's plane, and t its angle from the unit vector a on,
 *     2 T_i = - sum m_i t,    3 T_ij = solid angle (i = j) - sum m_j (integral of w_i over the edge),
 * the last one being a_i sin t + (m x a)_i (1 - cos t). */
void harmonics_of_polygon(int n, const double (*corner)[3], double solid_angle, double out[HARMONICS]) {
    double T1[3] = {0}, T2[3][3] = {{solid_angle / 3}, {0, solid_angle / 3}, {0, 0, solid_angle / 3}};
    for (int c = 0; c < n; c++) {
        const double *from = corner[c], *to = corner[(c + 1) % n];
        double m[3], a[3], across[3];
        cross3(from, to, m);
        const double sine = sqrt(dot3(m, m)), length = sqrt(dot3(from, from));
        if (!(sine > 0)) continue;
        const double t = atan2(sine, dot3(from, to)), half = sin(t / 2);
        for (int d = 0; d < 3; d++) {
            m[d] /= sine;
            a[d] = from[d] / length;
        }
        cross3(m, a, across);
        for (int i = 0; i < 3; i++) {
            const double along = a[i] * sin(t) + across[i] * 2 * half * half;
            T1[i] -= m[i] * t / 2;
            for (int j = 0; j < 3; j++) T2[i][j] -= m[j] * along / 3;
        }
    }
    combine(solid_angle, T1, T2, out);
}
