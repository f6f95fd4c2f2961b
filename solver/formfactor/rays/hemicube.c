#include "solver/formfactor/rays/hemicube.h"

#include "solver/formfactor/rows/row_pool.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <stdlib.h>

/* The density on top, 1 / (pi (x^2 + y^2 + 1)^2), integrated over [0, x] x [0, y]. */
static double top_integral(double x, double y) {
    const double u = sqrt(1 + x * x), w = sqrt(1 + y * y);
    return (x / u * atan(y / u) + y / w * atan(x / w)) / (2 * M_PI);
}

/* An antiderivative in y and z of the density on a side, z / (pi (y^2 + z^2 + 1)^2). */
static double side_integral(double y, double z) {
    const double u = sqrt(1 + z * z);
    return -atan(y / u) / (2 * M_PI * u);
}

/* table[row][column] = the exact integral over that pixel. The density at its centre times dA, as in Cohen
 * and Greenberg 1985, would not sum to 1. */
static void fill_table(double *table, size_t half, double (*integral)(double, double)) {
    const double width = 1 / (double)half;
    for (size_t row = 0; row < half; row++) {
        const double z0 = width * (double)row, z1 = width * (double)(row + 1);
        for (size_t column = 0; column < half; column++) {
            const double y0 = width * (double)column, y1 = width * (double)(column + 1);
            table[row * half + column] =
                (integral(y1, z1) - integral(y0, z1)) - (integral(y1, z0) - integral(y0, z0));
        }
    }
}

lam_status hemicube_create(size_t resolution, hemicube *out, lam_error *error) {
    lam_status status = LAM_OK;
    hemicube h = {.resolution = resolution};
    const size_t half = resolution / 2;
    if (resolution < HEMICUBE_RESOLUTION_LEAST || resolution > HEMICUBE_RESOLUTION_MOST ||
        resolution % 2 != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--resolution %zu: must be even and from %d to %d", resolution,
             HEMICUBE_RESOLUTION_LEAST, HEMICUBE_RESOLUTION_MOST);
    h.top = memory_allocate(half * half, sizeof *h.top, "the hemicube's pixels", error);
    h.side = memory_allocate(half * half, sizeof *h.side, "the hemicube's pixels", error);
    if (h.top == NULL || h.side == NULL) TRY(LAM_ERR_MEMORY);
    fill_table(h.top, half, top_integral);
    fill_table(h.side, half, side_integral);
    *out = h;
    h = (hemicube){0};
done:
    hemicube_free(&h);
    return status;
}

void hemicube_free(hemicube *h) {
    free(h->top);
    free(h->side);
    *h = (hemicube){0};
}

size_t hemicube_rows(const hemicube *h, int face) {
    return face == HEMICUBE_TOP ? h->resolution : h->resolution / 2;
}

/* The distance of a pixel from the middle line of a face. */
static size_t from_middle(size_t pixel, size_t half) {
    return pixel < half ? half - 1 - pixel : pixel - half;
}

double hemicube_weight(const hemicube *h, int face, size_t row, size_t column) {
    const size_t half = h->resolution / 2, across = from_middle(column, half);
    return face == HEMICUBE_TOP ? h->top[from_middle(row, half) * half + across]
                                : h->side[row * half + across];
}

/* The context that the hemicubes of all elements share. */
typedef struct cube_context {
    const hemicube *h;
    const mesh *m;
    const visibility *v;
    const sky_bounce *sky;
} cube_context;

/* A face in the scene: pixels lie at forward + x across + y up from the centroid. */
typedef struct cube_face {
    float forward[3], across[3], up[3];
} cube_face;

/* Sides 1 to 4 face along the tangent, the bitangent, and against them. */
static cube_face place_face(const element_frame *frame, int face) {
    cube_face f;
    const bool along_tangent = face % 2 == 1;
    const float sign = face > 2 ? -1 : 1;
    for (int d = 0; d < 3; d++) {
        if (face == HEMICUBE_TOP) {
            f.forward[d] = frame->normal[d];
            f.across[d] = frame->tangent[d];
            f.up[d] = frame->bitangent[d];
        } else {
            f.forward[d] = sign * (along_tangent ? frame->tangent[d] : frame->bitangent[d]);
            f.across[d] = along_tangent ? frame->bitangent[d] : frame->tangent[d];
            f.up[d] = frame->normal[d];
        }
    }
    return f;
}

/* Directions through the centres of the pixels from column on, in a row at height y: x = (2 column + 1)/res
 * - 1. */
static void aim(const cube_face *f, float y, size_t column, size_t resolution, ray_packet *rays) {
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        const float x = (float)(2 * (column + (size_t)i) + 1) / (float)resolution - 1;
        for (int d = 0; d < 3; d++) rays->direction[d][i] = f->forward[d] + x * f->across[d] + y * f->up[d];
    }
}

/* F_ij = the sum of the weights of the pixels whose centres show j. */
static void trace_element(const void *context, size_t element, row_pool *pool, double *leaving,
                          double *absorbed) {
    const cube_context *c = context;
    const size_t resolution = c->h->resolution;
    element_frame frame;
    element_frame_init(&frame, c->m, element);
    double centroid[3];
    float eye[3];
    mesh_centroid(c->m, element, centroid);
    visibility_recentre(c->v, centroid, eye);
    uint32_t self[VISIBILITY_PACKET];
    ray_packet rays;
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        self[i] = (uint32_t)element;
        for (int d = 0; d < 3; d++) rays.origin[d][i] = eye[d];
    }
    double left = 0, lost = 0;
    for (int face = 0; face < HEMICUBE_FACES; face++) {
        const cube_face f = place_face(&frame, face);
        const float lowest = face == HEMICUBE_TOP ? -1 : 0;
        for (size_t row = 0; row < hemicube_rows(c->h, face); row++) {
            const float y = (float)(2 * row + 1) / (float)resolution + lowest;
            for (size_t column = 0; column < resolution; column += VISIBILITY_PACKET) {
                hit_packet hits;
                const size_t rest = resolution - column,
                             n = rest < VISIBILITY_PACKET ? rest : VISIBILITY_PACKET;
                aim(&f, y, column, resolution, &rays);
                visibility_cast(c->v, &rays, n, self, VISIBILITY_TOGETHER, &hits);
                double weights[VISIBILITY_PACKET] = {0};
                unsigned leaving_now = 0;
                for (size_t i = 0; i < n; i++) {
                    const double weight = weights[i] = hemicube_weight(c->h, face, row, column + i);
                    if (hits.element[i] == VISIBILITY_NOTHING) {
                        left += weight;
                        leaving_now |= 1u << i;
                    } else if (hits.back[i]) {
                        lost += weight;
                    } else {
                        row_pool_add(pool, hits.element[i], weight);
                    }
                }
                row_pool_leave(pool, c->sky, &rays, leaving_now, weights);
            }
        }
    }
    *leaving = left;
    *absorbed = lost;
}

lam_status hemicube_trace(const hemicube *h, const mesh *m, const visibility *v, const uint32_t *order,
                          const form_factor_options *options, packed_rows *rows, double *leaving,
                          double *absorbed, lam_error *error) {
    const cube_context context = {.h = h, .m = m, .v = v, .sky = options->bounce};
    const row_maker maker = {.make = trace_element,
                             .context = &context,
                             .kind = ROW_WEIGHTS,
                             .rays = 3 * h->resolution * h->resolution,
                             .whole = 1,
                             .sky = options->bounce,
                             .cheaper = "a lower --resolution",
                             .progress = options->progress,
                             .stage = options->stage,
                             .m = m,
                             .recipe = &options->recipe,
                             .only_first = options->only_first,
                             .scratch = options->scratch,
                             .scratch_name = options->scratch_name};
    return row_pool_make(&maker, order, rows, leaving, absorbed, error);
}
