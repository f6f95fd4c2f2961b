/* Vectors of three numbers. */
#ifndef LAMBERT_BASE_VECTOR3_H
#define LAMBERT_BASE_VECTOR3_H

static inline double dot3(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out = a - b; out may be either. */
static inline void subtract3(const double *a, const double *b, double *out) {
    for (int d = 0; d < 3; d++) out[d] = a[d] - b[d];
}

/* out = a x b; out must be neither. */
static inline void cross3(const double *a, const double *b, double *out) {
    for (int d = 0; d < 3; d++) out[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

#endif
