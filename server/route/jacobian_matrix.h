/* The matrix of derivatives of a request, row by row or column by column: values of sensors by the columns of
 * server/scene/sensor_columns.h, means of groups by the adjoint rows of server/scene/adjoint_rows.h, and
 * values of elements by whichever are fewer. Columns, rows of groups and the last matrices of elements stay
 * with the scene. */
#ifndef LAMBERT_SERVER_ROUTE_JACOBIAN_MATRIX_H
#define LAMBERT_SERVER_ROUTE_JACOBIAN_MATRIX_H

#include "server/route/call.h"
#include "solver/codec/jacobian.h"

/* Starts zeroed. */
typedef struct jacobian_matrix {
    const jacobian_request *request;
    size_t n_rows, n_columns; /* columns are counted over all kinds asked for */
    bool by_rows;
    bool known;    /* values are those that the scene has kept, of elements */
    float *values; /* of each kind after the other: [C][rows][columns of the kind]; NAN where a row has no
                      value */
    float *made;   /* of a pass of columns of sensors, [BATCH_PASS][sensor_column_width] */
    float *work;   /* of a pass of columns */
} jacobian_matrix;

/* Takes the memory of the request; request stays where it is. False with *why, and free it also then. */
bool jacobian_matrix_begin(call *in, const jacobian_request *request, jacobian_matrix *m, problem *why);
void jacobian_matrix_free(jacobian_matrix *m);

/* Rows or columns, whichever it is made of; 1 of a matrix that is known. */
static inline size_t jacobian_matrix_parts(const jacobian_matrix *m) {
    return m->known ? 1 : m->by_rows ? m->n_rows : m->n_columns;
}

/* Makes parts first ... first + count, at most BATCH_PASS, by one pass over the operator at most. */
bool jacobian_matrix_make(call *in, jacobian_matrix *m, size_t first, size_t count,
                          batch_workspace *workspace, problem *why);

/* Lets the scene keep a whole matrix of elements, for who asks again. */
void jacobian_matrix_keep(const scene *s, const jacobian_matrix *m);

/* The first light of a kind (sensor_lights), and how many it has. */
size_t jacobian_lights(const scene *s, lam_by kind, size_t *first);

#endif
