#include "solver/linalg/core.h"
#include "solver/method/norm.h"
#include "solver/method/two_mesh/method_two_mesh.h"

#include <math.h>
#include <stdlib.h>

/* Areas within a patch count as equal if they differ by a few roundings of single precision. */
static const double equal_areas = 0x1p-22;

/* V_jp by position, in double: A_j / A_p. */
static double share_of(const build_problem *problem, const coarse_mesh *mesh, size_t p, uint64_t position) {
    return problem->area[mesh->element[position]] / mesh->area[p];
}

static bool has_equal_patches(const build_problem *problem, const coarse_mesh *mesh) {
    for (size_t p = 0; p < mesh->k; p++) {
        const double count = (double)(mesh->begin[p + 1] - mesh->begin[p]);
        for (uint64_t j = mesh->begin[p]; j < mesh->begin[p + 1]; j++)
            if (fabs(share_of(problem, mesh, p, j) * count - 1) > equal_areas) return false;
    }
    return true;
}

lam_status two_mesh_factors(const build_problem *problem, const coarse_mesh *mesh, float **U, float **weight,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = mesh->n, k = mesh->k;
    const csr *F = problem->F;
    const bool equal = has_equal_patches(problem, mesh);
    float *u = memory_allocate(n, k * sizeof *u, "U of two meshes", error), *w = NULL;
    uint32_t *patch = memory_allocate(n, sizeof *patch, "patches", error);
    bool failed = false;
    if (u == NULL || patch == NULL) TRY(LAM_ERR_MEMORY);
    if (!equal) {
        w = memory_allocate(n, sizeof *w, "weights", error);
        if (w == NULL) TRY(LAM_ERR_MEMORY);
    }
    for (size_t p = 0; p < k; p++)
        for (uint64_t j = mesh->begin[p]; j < mesh->begin[p + 1]; j++) {
            patch[mesh->element[j]] = (uint32_t)p;
            if (w != NULL) w[j] = (float)share_of(problem, mesh, p, j);
        }
#pragma omp parallel
    {
        double *row = memory_allocate(k, sizeof *row, "a row of U", NULL);
#pragma omp for schedule(dynamic, 64)
        for (size_t position = 0; position < n; position++) {
            const uint32_t e = mesh->element[position];
            if (row == NULL) {
#pragma omp atomic write
                failed = true;
                continue;
            }
            for (size_t p = 0; p < k; p++) row[p] = 0;
            for (uint64_t q = F->indptr[e]; q < F->indptr[e + 1]; q++) /* U_ep = sum F_ej */
                row[patch[F->indices[q]]] += (double)F->data[q];
            for (size_t p = 0; p < k; p++)
                u[position * k + p] =
                    (float)(equal ? row[p] / (double)(mesh->begin[p + 1] - mesh->begin[p]) : row[p]);
        }
        free(row);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "U of two meshes: out of memory");
    *U = u;
    *weight = w;
    u = w = NULL;
done:
    free(u);
    free(w);
    free(patch);
    return status;
}

lam_status two_mesh_core(const coarse_mesh *mesh, const float *U, const float *weight,
                         const float *reflectance, float *core, double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    const core_factors in = {.n = mesh->n,
                             .k = mesh->k,
                             .U = U,
                             .begin = mesh->begin,
                             .weight = weight,
                             .rho = reflectance,
                             .order = mesh->element};
    status = core_make(&in, core, rcond, error);
    if (status == LAM_ERR_NUMERIC)
        FAIL(
            error, LAM_ERR_NUMERIC,
            "--method 2msc: I - V^T R U of %zu patches cannot be inverted, its reciprocal condition is below "
            "%g; lower the largest reflectance, or see with lambert verify whether the rows of the form "
            "factors sum to more than 1",
            mesh->k, CORE_RCOND_MIN);
done:
    return status;
}

typedef struct remainder {
    const build_problem *problem;
    const coarse_mesh *mesh;
    const scaled_matrix *S;
    double *x, *y; /* [n] */
} remainder_product;

/* x -= W W^T x, W_jp = (A_j / A_p)^1/2; x in the order of S. */
static void subtract_patches(const remainder_product *D, double *x) {
    const coarse_mesh *mesh = D->mesh;
    const uint32_t *position = D->S->position;
    for (size_t p = 0; p < mesh->k; p++) {
        double sum = 0;
        for (uint64_t j = mesh->begin[p]; j < mesh->begin[p + 1]; j++)
            sum += sqrt(share_of(D->problem, mesh, p, j)) * x[position[mesh->element[j]]];
        for (uint64_t j = mesh->begin[p]; j < mesh->begin[p + 1]; j++)
            x[position[mesh->element[j]]] -= sqrt(share_of(D->problem, mesh, p, j)) * sum;
    }
}

/* D = S (I - W W^T): D^T D q = (I - W W^T) S S (I - W W^T) q */
static lam_status remainder_square(void *context, const double *q, double *w, lam_error *error) {
    lam_status status = LAM_OK;
    const remainder_product *D = context;
    for (size_t i = 0; i < D->mesh->n; i++) D->x[i] = q[i];
    subtract_patches(D, D->x);
    TRY(scaled_multiply_double(D->S, D->x, D->y, error));
    TRY(scaled_multiply_double(D->S, D->y, w, error));
    subtract_patches(D, w);
done:
    return status;
}

lam_status two_mesh_norm(const build_problem *problem, const coarse_mesh *mesh, const scaled_matrix *S,
                         const progress *p, double *norm, lam_error *error) {
    lam_status status = LAM_OK;
    remainder_product D = {.problem = problem, .mesh = mesh, .S = S};
    D.x = memory_allocate(mesh->n, sizeof *D.x, "norm", error);
    D.y = memory_allocate(mesh->n, sizeof *D.y, "norm", error);
    if (D.x == NULL || D.y == NULL) TRY(LAM_ERR_MEMORY);
    TRY(norm_of_product(mesh->n, remainder_square, &D, p, norm, error));
done:
    free(D.x);
    free(D.y);
    return status;
}
