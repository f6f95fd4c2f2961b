#include "solver/scene/face_grid.h"

#include <math.h>
#include <string.h>

double point_distance(const double a[3], const double b[3]) {
    const double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* A total order of points. */
static int comes_first(const double a[3], const double b[3]) {
    for (int c = 0; c < 3; c++)
        if (a[c] != b[c]) return a[c] < b[c];
    return 1;
}

void edge_point(const double a[3], const double b[3], size_t k, size_t m, double out[3]) {
    if (!comes_first(a, b)) {
        const double *swap = a;
        a = b, b = swap;
        k = m - k;
    }
    const double *from = a;
    const double share = (double)k / (double)m;
    for (int c = 0; c < 3; c++) out[c] = k == m ? b[c] : from[c] + (b[c] - from[c]) * share;
}

void grid_point(const double quad[4][3], size_t i, size_t na, size_t j, size_t nb, double out[3]) {
    double low[3], high[3];
    /* On the quad's border this is the edge_point that the neighbour computes. */
    if (i == 0 || i == na) {
        edge_point(quad[i == 0 ? 0 : 1], quad[i == 0 ? 3 : 2], j, nb, out);
        return;
    }
    edge_point(quad[0], quad[1], i, na, low);
    edge_point(quad[3], quad[2], i, na, high);
    edge_point(low, high, j, nb, out);
}

void triangle_point(const double triangle[3][3], size_t i, size_t j, size_t m, double out[3]) {
    if (j == 0) {
        edge_point(triangle[0], triangle[1], i, m, out);
    } else if (i == 0) {
        edge_point(triangle[0], triangle[2], j, m, out);
    } else if (i + j == m) {
        edge_point(triangle[1], triangle[2], j, m, out);
    } else {
        const double u = (double)i / (double)m, v = (double)j / (double)m;
        for (int c = 0; c < 3; c++)
            out[c] = triangle[0][c] + u * (triangle[1][c] - triangle[0][c]) +
                     v * (triangle[2][c] - triangle[0][c]);
    }
}
