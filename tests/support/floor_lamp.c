#include "support/floor_lamp.h"

#include "support/box.h"

mesh floor_lamp_mesh(size_t cells) {
    mesh m = {0};
    for (size_t j = 0; j < cells; j++)
        for (size_t i = 0; i < cells; i++) {
            const double step = 3. / (double)cells;
            mesh_add_cell(&m,
                          &(box_cell){.axis = 2,
                                      .level = 0,
                                      .from = {step * (double)i, step * (double)j, 0},
                                      .to = {step * (double)(i + 1), step * (double)(j + 1), 0}},
                          true);
        }
    mesh_add_cell(&m, &(box_cell){.axis = 2, .level = 1, .from = {.7, 1, 1}, .to = {1.7, 2, 1}}, false);
    mesh_finish(&m, floor_lamp_rho);
    m.n_groups = 1;
    m.reflectance[m.n - 1] = 0;
    m.emission[m.n - 1] = 1;
    return m;
}

/* The share of light from a point that meets a rectangle [0, a] x [0, b] at height 1 above a corner of it
 * (Howell, configuration C-11), odd in a and in b. */
static double corner(double a, double b) {
    const double s = sqrt(1 + a * a), t = sqrt(1 + b * b);
    return (a / s * atan(b / s) + b / t * atan(a / t)) / (2 * M_PI);
}

/* F from the point (x, y) of the floor to the lamp. */
double floor_lamp_truth(double x, double y) {
    return corner(1.7 - x, 2 - y) - corner(.7 - x, 2 - y) - corner(1.7 - x, 1 - y) + corner(.7 - x, 1 - y);
}

/* Mean and variance of the truth over an element of the floor, by 16 x 16 points of each half of a quad. */
void floor_lamp_over(const mesh *m, size_t i, double *mean, double *variance) {
    enum { POINTS = 16 };
    double sum = 0, squares = 0, area = 0;
    for (size_t half = 0; half + 2 < mesh_corners(m, i); half++) {
        const double *a = m->vertices[m->elements[i][0]], *b = m->vertices[m->elements[i][half + 1]],
                     *c = m->vertices[m->elements[i][half + 2]];
        const double A = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        for (int k = 0; k < POINTS * POINTS; k++) {
            const double u = sqrt((k % POINTS + .5) / POINTS), v = (k / POINTS + .5) / POINTS * u;
            const double F = floor_lamp_truth(a[0] + (u - v) * (b[0] - a[0]) + v * (c[0] - a[0]),
                                              a[1] + (u - v) * (b[1] - a[1]) + v * (c[1] - a[1]));
            sum += A * F;
            squares += A * F * F;
        }
        area += POINTS * POINTS * A;
    }
    *mean = sum / area;
    *variance = squares / area - *mean * *mean;
}

/* The true error of constants, and B [n] with them; the elements that are not the lamp lie in the floor. */
double floor_lamp_error(const mesh *m, float *B) {
    double off = 0, all = 0;
    for (size_t i = 0; i < m->n; i++) {
        double mean, variance;
        if (B != NULL) B[i] = m->emission[i];
        if (m->emission[i] > 0) continue;
        floor_lamp_over(m, i, &mean, &variance);
        if (B != NULL) B[i] = floor_lamp_rho * (float)mean;
        off += m->area[i] * variance;
        all += m->area[i] * mean * mean;
    }
    return sqrt(off / all);
}
