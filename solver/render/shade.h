/* The values drawn at points of elements: constant on each element, or smoothed within a surface. */
#ifndef LAMBERT_RENDER_SHADE_H
#define LAMBERT_RENDER_SHADE_H

#include "solver/render/smooth.h"

typedef struct shade shade;

#define SHADE_MAX_CHANNELS 64

/* values[c * n + i] is the value of element i in channel c; only the first SHADE_MAX_CHANNELS are kept.
 * nodes: light inside elements as smooth_corners says, with E its part that does not vary there, or NULL.
 * nodes NULL: constant on each element. The mesh must outlive it, the nodes need not. Errors: LAM_ERR_MEMORY.
 */
lam_status shade_create(const mesh *m, size_t n_channels, const float *values, const float *E,
                        const smooth_nodes *nodes, shade **out, lam_error *error);
void shade_destroy(shade *s);

size_t shade_channels(const shade *s);

/* The weights of the corners of an element at a point, in scene coordinates; at its projection where it is
 * off the plane. Of a triangle the last is 0. */
void shade_weights(const mesh *m, uint32_t element, const double point[3], float weights[4]);

/* The values [C] where the corners of an element have these weights, which constant light does not read. */
void shade_mix(const shade *s, uint32_t element, const float *weights, float *values);

/* The values [C] at a point of an element, as shade_weights places it. */
void shade_at(const shade *s, uint32_t element, const double point[3], float *values);

#endif
