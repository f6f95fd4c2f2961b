/* Moving lights as rays need them: frames of positions, and the pieces that points are chosen on. */
#include "solver/walk/light_frames.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>

static void to_float(const double a[3], float out[3]) {
    for (int d = 0; d < 3; d++) out[d] = (float)a[d];
}

void light_frame_set(const visibility *v, const moving_light *l, const light_pose *p, light_frame *out) {
    double normal[3], side[3], tangent[3], centre[3] = {0, 0, 0}, at[3], lift[3];
    const double rounding = visibility_rounding(v);
    light_pose_direction(p, l->normal, normal);
    for (int d = 0; d < 3; d++) side[d] = l->corner[1][d] - l->corner[0][d];
    light_pose_direction(p, side, tangent);
    const double length = sqrt(tangent[0] * tangent[0] + tangent[1] * tangent[1] + tangent[2] * tangent[2]);
    for (int d = 0; d < 3; d++) tangent[d] /= length;
    const double b[3] = {normal[1] * tangent[2] - normal[2] * tangent[1],
                         normal[2] * tangent[0] - normal[0] * tangent[2],
                         normal[0] * tangent[1] - normal[1] * tangent[0]};
    for (size_t k = 0; k < l->n_corners; k++)
        for (int d = 0; d < 3; d++) centre[d] += l->corner[k][d] / (double)l->n_corners;
    light_pose_point(p, centre, at);
    /* A light that lies in a face starts above it. */
    for (int d = 0; d < 3; d++) lift[d] = p->move[d] + 4 * rounding * normal[d];
    for (int d = 0; d < 3; d++) at[d] += 4 * rounding * normal[d];
    visibility_recentre(v, lift, out->move);
    visibility_recentre(v, at, out->centre);
    for (int d = 0; d < 3; d++) to_float(p->turn[d], out->turn[d]);
    to_float(tangent, out->tangent);
    to_float(b, out->bitangent);
    to_float(normal, out->normal);
}

void light_pieces_free(light_pieces *p) {
    free(p->piece);
    free(p->carried);
    *p = (light_pieces){.n = 0};
}

/* A piece as a position carries it. */
static void carry(const light_piece *piece, const light_frame *f, bool triangle, walk_shape *out) {
    *out = (walk_shape){.facet = triangle ? WALK_NO_FACET | WALK_TRIANGLE : WALK_NO_FACET};
    for (int d = 0; d < 3; d++) {
        out->normal[d] = f->normal[d];
        out->corner[d] = f->move[d];
        for (int k = 0; k < 3; k++) {
            out->corner[d] += f->turn[d][k] * piece->corner[k];
            for (int e = 0; e < 2; e++) out->edge[e][d] += f->turn[d][k] * piece->edge[e][k];
        }
    }
}

lam_status light_pieces_create(const moving_light *l, const light_frame *frames, light_pieces *out,
                               lam_error *error) {
    double off = 0, size = 0;
    for (int d = 0; d < 3 && l->n_corners == 4; d++) {
        off += fabs(l->corner[0][d] - l->corner[1][d] + l->corner[2][d] - l->corner[3][d]);
        size += fabs(l->corner[2][d] - l->corner[0][d]);
    }
    const bool parallelogram = l->n_corners == 4 && off <= 1e-9 * size;
    light_pieces p = {.n = parallelogram ? 1 : l->n_corners - 2, .parallelogram = parallelogram};
    for (size_t k = 0; k < l->n_corners; k++)
        for (int d = 0; d < 3; d++) p.middle[d] += (float)(l->corner[k][d] / (double)l->n_corners);
    p.piece = memory_allocate(p.n, sizeof *p.piece, "light", error);
    p.carried = memory_allocate(p.n, l->n * sizeof *p.carried, "light", error);
    if (p.piece == NULL || p.carried == NULL) {
        light_pieces_free(&p);
        return LAM_ERR_MEMORY;
    }
    for (size_t k = 0; k < p.n; k++) {
        const double *next[2] = {l->corner[k + 1], l->corner[parallelogram ? 3 : k + 2]};
        p.piece[k].share = parallelogram ? 1 : l->share[k];
        to_float(l->corner[0], p.piece[k].corner);
        for (int e = 0; e < 2; e++) {
            double edge[3];
            subtract3(next[e], l->corner[0], edge);
            to_float(edge, p.piece[k].edge[e]);
        }
        for (size_t i = 0; i < l->n; i++)
            carry(&p.piece[k], &frames[i], !parallelogram, &p.carried[i * p.n + k]);
    }
    *out = p;
    return LAM_OK;
}

size_t light_pieces_choose(const light_pieces *p, uint32_t *place) {
    size_t k = 0;
    if (p->n == 1) return 0;
    const double u = *place * 0x1p-32;
    while (k + 1 < p->n && u >= p->piece[k].share) k++;
    const double before = k > 0 ? p->piece[k - 1].share : 0, part = p->piece[k].share - before;
    *place = (uint32_t)fmin(fmax((u - before) / part, 0) * 0x1p32, 0x1p32 - 1);
    return k;
}

size_t light_pieces_part(const light_pieces *p, size_t split, const uint32_t place[4]) {
    if (!p->parallelogram) return 0;
    return (size_t)((uint64_t)place[1] * split >> 32) * split + (size_t)((uint64_t)place[0] * split >> 32);
}

void light_pieces_middle(const light_pieces *p, size_t split, size_t part, float local[3]) {
    const float per = 1 / (float)split;
    const float a = ((float)(part % split) + .5f) * per, b = ((float)(part / split) + .5f) * per;
    for (int d = 0; d < 3; d++)
        local[d] = p->parallelogram
                       ? p->piece->corner[d] + a * p->piece->edge[0][d] + b * p->piece->edge[1][d]
                       : p->middle[d];
}

void light_pieces_point(const light_pieces *p, size_t k, const uint32_t place[4], float local[3]) {
    const light_piece *piece = &p->piece[k];
    const float u = (float)(place[0] >> 8) * 0x1p-24f, w = (float)(place[1] >> 8) * 0x1p-24f;
    const float half = p->parallelogram ? 0 : .5f * (u < w ? u : w), a = u - half, b = w - half;
    for (int d = 0; d < 3; d++) local[d] = piece->corner[d] + a * piece->edge[0][d] + b * piece->edge[1][d];
}
