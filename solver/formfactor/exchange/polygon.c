#include "solver/formfactor/exchange/polygon.h"

#include "solver/base/vector3.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <string.h>

/* Twice the area vector, by Newell's formula about the first corner. */
static void area_vector(const polygon *p, double out[3]) {
    memset(out, 0, 3 * sizeof *out);
    for (int c = 1; c + 1 < p->n; c++) {
        double u[3], v[3];
        for (int d = 0; d < 3; d++) {
            u[d] = p->corner[c][d] - p->corner[0][d];
            v[d] = p->corner[c + 1][d] - p->corner[0][d];
        }
        for (int d = 0; d < 3; d++)
            out[d] += u[(d + 1) % 3] * v[(d + 2) % 3] - u[(d + 2) % 3] * v[(d + 1) % 3];
    }
}

double polygon_area(const polygon *p) {
    double twice[3];
    area_vector(p, twice);
    return .5 * sqrt(dot3(twice, twice));
}

void polygon_set_extent(polygon *p) {
    memset(p->centre, 0, sizeof p->centre);
    for (int c = 0; c < p->n; c++)
        for (int d = 0; d < 3; d++) p->centre[d] += p->corner[c][d] / p->n;
    p->radius = 0;
    for (int c = 0; c < p->n; c++) {
        double r[3];
        for (int d = 0; d < 3; d++) r[d] = p->corner[c][d] - p->centre[d];
        p->radius = fmax(p->radius, sqrt(dot3(r, r)));
    }
    double off = 0;
    for (int d = 0; d < 3 && p->n == 4; d++)
        off += fabs(p->corner[0][d] - p->corner[1][d] + p->corner[2][d] - p->corner[3][d]);
    p->affine = p->n == 3 || (p->n == 4 && off <= 1e-12 * p->radius);
}

void polygon_measure(polygon *p) {
    double twice[3];
    area_vector(p, twice);
    const double length = sqrt(dot3(twice, twice));
    for (int d = 0; d < 3; d++) p->normal[d] = twice[d] / length;
    polygon_set_extent(p);
}

void polygon_of_element(const mesh *m, size_t element, polygon *out) {
    const uint32_t *corner = m->elements[element];
    *out = (polygon){.n = (int)mesh_corners(m, element)};
    for (int c = 0; c < out->n; c++) memcpy(out->corner[c], m->vertices[corner[c]], sizeof out->corner[c]);
    polygon_measure(out);
}

static plane_face face_of(const polygon *p) {
    return (plane_face){p->n, (const double(*)[3])p->corner, p->centre, p->normal, p->radius};
}

void polygon_in_front(const polygon *p, const polygon *other, polygon *out) {
    double height[POLYGON_CORNERS], most = 0, least = INFINITY;
    const plane_face own = face_of(p), others = face_of(other);
    if (plane_is_shared(&own, &others)) {
        *out = *p;
        out->n = 0;
        return;
    }
    for (int c = 0; c < p->n; c++) {
        double r[3];
        for (int d = 0; d < 3; d++) r[d] = p->corner[c][d] - other->centre[d];
        height[c] = dot3(r, other->normal);
        most = fmax(most, height[c]);
        least = fmin(least, height[c]);
    }
    /* Rounding moves corners of the plane itself off it. */
    const double rounding = 1e-12 * (p->radius + other->radius);
    if (least >= 0 && most > rounding) {
        *out = *p;
        return;
    }
    polygon made = *p;
    made.n = 0;
    for (int c = 0; c < p->n && most > rounding; c++) {
        const int next = (c + 1) % p->n;
        if (height[c] >= 0) memcpy(made.corner[made.n++], p->corner[c], sizeof made.corner[0]);
        if ((height[c] > 0 && height[next] < 0) || (height[c] < 0 && height[next] > 0)) {
            const double t = height[c] / (height[c] - height[next]);
            for (int d = 0; d < 3; d++)
                made.corner[made.n][d] = p->corner[c][d] + t * (p->corner[next][d] - p->corner[c][d]);
            made.n++;
        }
    }
    if (made.n < 3) made.n = 0;
    if (made.n > 0) polygon_set_extent(&made);
    *out = made;
}

static double side2(const polygon *p, int c) {
    double sum = 0;
    for (int d = 0; d < 3; d++) {
        const double along = p->corner[(c + 1) % p->n][d] - p->corner[c][d];
        sum += along * along;
    }
    return sum;
}

void polygon_halve(const polygon *p, polygon halves[2]) {
    int cut = 0; /* the side that is cut, and of a quad the opposite one */
    double longest = 0;
    for (int c = 0; c < (p->n == 4 ? 2 : 3); c++) {
        const double length = p->n == 4 ? fmax(side2(p, c), side2(p, c + 2)) : side2(p, c);
        if (!(length > longest)) continue;
        longest = length;
        cut = c;
    }
    const int next = (cut + 1) % p->n, across = (cut + 2) % p->n, last = (cut + 3) % p->n;
    double middle[3], opposite[3];
    for (int d = 0; d < 3; d++) {
        middle[d] = .5 * (p->corner[cut][d] + p->corner[next][d]);
        opposite[d] = p->n == 4 ? .5 * (p->corner[across][d] + p->corner[last][d]) : p->corner[across][d];
    }
    for (int h = 0; h < 2; h++) {
        polygon *out = &halves[h];
        *out = (polygon){.n = p->n};
        memcpy(out->normal, p->normal, sizeof out->normal);
        /* Both halves keep the orientation: the first holds the begin of the cut side, the second its end. */
        if (h == 0) {
            memcpy(out->corner[0], p->corner[cut], sizeof middle);
            memcpy(out->corner[1], middle, sizeof middle);
            memcpy(out->corner[2], opposite, sizeof middle);
            if (p->n == 4) memcpy(out->corner[3], p->corner[last], sizeof middle);
        } else {
            memcpy(out->corner[0], middle, sizeof middle);
            memcpy(out->corner[1], p->corner[next], sizeof middle);
            memcpy(out->corner[2], p->n == 4 ? p->corner[across] : opposite, sizeof middle);
            if (p->n == 4) memcpy(out->corner[3], opposite, sizeof middle);
        }
        polygon_set_extent(out);
    }
}

double polygon_point(const polygon *p, double u, double w, double point[3]) {
    const double *a = p->corner[0], *b = p->corner[1], *c = p->corner[2], *e = p->corner[3];
    double along_u[3], along_w[3];
    if (p->n == 3) { /* the square folded along its diagonal */
        const bool beyond = u + w > 1;
        const double s = beyond ? 1 - u : u, t = beyond ? 1 - w : w;
        for (int d = 0; d < 3; d++) {
            along_u[d] = b[d] - a[d];
            along_w[d] = c[d] - a[d];
            point[d] = a[d] + s * along_u[d] + t * along_w[d];
        }
    } else { /* bilinear */
        for (int d = 0; d < 3; d++) {
            along_u[d] = (1 - w) * (b[d] - a[d]) + w * (c[d] - e[d]);
            along_w[d] = (1 - u) * (e[d] - a[d]) + u * (c[d] - b[d]);
            point[d] = (1 - w) * ((1 - u) * a[d] + u * b[d]) + w * ((1 - u) * e[d] + u * c[d]);
        }
    }
    double area[3];
    for (int d = 0; d < 3; d++)
        area[d] = along_u[(d + 1) % 3] * along_w[(d + 2) % 3] - along_u[(d + 2) % 3] * along_w[(d + 1) % 3];
    const double jacobian = sqrt(dot3(area, area));
    return p->n == 3 ? .5 * jacobian : jacobian;
}
