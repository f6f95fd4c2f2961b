/* Values of elements to values at the corners that elements share: a sparse matrix, made once for a mesh,
 * v = S (2 x - N S x). S fits linear light to the elements at a corner, and N gives its mean over each
 * element: what this differs by from x, as light bends, is added once. */
#ifndef LAMBERT_OPERATOR_CORNERS_CORNER_PLAN_H
#define LAMBERT_OPERATOR_CORNERS_CORNER_PLAN_H

#include "solver/operator/corners/corner_weights.h"

/* A node whose value is (1 - t) that of a + t that of b. */
typedef struct corner_link {
    uint32_t node, a, b;
    float t;
} corner_link;

/* Immutable once made; any number of threads may use it. */
typedef struct corner_plan {
    size_t n, n_nodes;
    corner_rows rows;   /* of free nodes, over elements */
    corner_link *links; /* [n_links], of hanging ones; both ends of one come before it */
    size_t n_links;
    corner_rows means; /* N, of elements, over nodes */
} corner_plan;

/* Nodes hang on others that hang, at most CORNER_DEPTH deep; a node that would hang on itself, or deeper, is
 * free: parts of 1/3 and of 1/4 of an edge have such. Cost: O(n). Errors: as corner_weights_find. */
#define CORNER_DEPTH 6
lam_status corner_plan_create(const corner_mesh *m, const corner_nodes *nodes, corner_plan *out,
                              lam_error *error);
void corner_plan_free(corner_plan *plan);

/* Bytes that it holds. */
size_t corner_plan_bytes(const corner_plan *plan);

/* out [n_rows][n_nodes] = v for rows x [n_rows][n], which are lost; v is nowhere below 0 and the least number
 * of x. Linear light is reproduced. Allocates nothing; a row's bits do not depend on its neighbours. Cost: 12
 * products an element of an even mesh. */
#define CORNER_ROWS_TOGETHER 4
void corner_plan_apply(const corner_plan *plan, size_t n_rows, float *x, float *out);

/* w [n_rows][n] += the transpose of g [n_rows][n_nodes], which is lost, but for the bound at 0. work
 * [n + n_nodes] is lost. */
void corner_plan_transpose(const corner_plan *plan, size_t n_rows, float *g, float *w, float *work);

/* The matrix as a whole: node j is the sum of rows parts[j] ... parts[j + 1] - 1, each of which is put to its
 * bound first: 0, or the least number times the sum of its weights. A node inside an edge has several, those
 * of the ends. */
typedef struct corner_matrix {
    size_t n_nodes;
    uint32_t *parts; /* [n_nodes + 1], below 2^32 */
    corner_rows rows;
} corner_matrix;

/* Freed by corner_matrix_free; weights below 1e-6 are left out. Errors: LAM_ERR_MEMORY, LAM_ERR_ARGUMENT
 * (more than `most` weights, or a part for more than every CORNER_WEIGHTS_OF_PART of these). */
#define CORNER_WEIGHTS_OF_PART 4
lam_status corner_plan_expand(const corner_plan *plan, size_t most, corner_matrix *out, lam_error *error);
void corner_matrix_free(corner_matrix *matrix);

#endif
