/* The charts of a lightmap: each is a rectangle of texels around a plane part of a group, and all of them are
 * packed into one map with a border of LIGHTMAP_BORDER texels around each. Knows no light. */
#ifndef LAMBERT_LIGHTMAP_CHARTS_H
#define LAMBERT_LIGHTMAP_CHARTS_H

#include "solver/scene/mesh.h"

enum { LIGHTMAP_BORDER = 2, LIGHTMAP_SIDE_MOST = 8192 };

/* Texels of a map, with borders. */
#define LIGHTMAP_TEXELS_MOST ((size_t)4 << 20)

/* Texels, with borders, from which on the preset takes larger ones. */
#define LIGHTMAP_TEXELS_PRESET ((size_t)1 << 16)

typedef struct lightmap_chart {
    size_t first, count;        /* of elements, of the charts */
    double origin[3];           /* m, the corner of its first texel */
    double axis[2][3], step[2]; /* unit vectors along rows and columns, and m: the sides of a texel */
    size_t width, height;       /* texels, without the border */
    size_t x, y;                /* of its first texel in the map */
} lightmap_chart;

typedef struct lightmap_charts {
    size_t n, width, height; /* of charts, and of the map */
    double texel;            /* m, no side of a texel is longer */
    bool enlarged;           /* the preset was, for LIGHTMAP_TEXELS_PRESET */
    lightmap_chart *charts;  /* [n] */
    uint32_t *elements;      /* [elements of the mesh], by charts */
    uint32_t *chart_of;      /* [elements of the mesh] */
} lightmap_charts;

/* texel: m; 0: half the root of the mean area of elements, or more where these would be too many. Freed by
 * lightmap_charts_free. Cost: O(n log n). Errors: LAM_ERR_ARGUMENT (more than LIGHTMAP_TEXELS_MOST texels:
 * the line names a texel that fits), LAM_ERR_MEMORY. */
lam_status lightmap_charts_make(const mesh *m, double texel, lightmap_charts *out, lam_error *error);
void lightmap_charts_free(lightmap_charts *c);

/* The place of a point in the map, in texels from its first corner. */
void lightmap_place(const lightmap_chart *c, const double at[3], double place[2]);

/* The point of a chart at a place. */
void lightmap_point(const lightmap_chart *c, const double place[2], double at[3]);

#endif
