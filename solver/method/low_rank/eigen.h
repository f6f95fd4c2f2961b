/* Eigenvectors of a symmetric matrix in single precision, by LAPACK's ssyevd (divide and conquer). */
#ifndef LAMBERT_METHOD_LOW_RANK_EIGEN_H
#define LAMBERT_METHOD_LOW_RANK_EIGEN_H

#include <stdbool.h>
#include <stddef.h>

/* Rows at most, with vectors: LAPACK counts its work area, 1 + 6 m + 2 m^2 numbers, in 32 bits. */
enum { EIGEN_SINGLE_MOST = 32766 };

/* All eigenvalues of G [m][m], whose entries j >= i are read, ascending, into values [m]; with vectors, row c
 * of G becomes the c-th eigenvector, else G's content is lost. Returns LAPACK's info: 0 where all is well,
 * and LAPACK_WORK_MEMORY_ERROR where the work area cannot be had or counted. Cost: O(m^3). */
int eigen_single(size_t m, bool vectors, float *G, float *values);

#endif
