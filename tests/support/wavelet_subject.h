/* Meshes with form factors, their trees of planes and bases of wavelets, and dense matrices in those. */
#ifndef LAMBERT_TESTS_WAVELET_SUBJECT_H
#define LAMBERT_TESTS_WAVELET_SUBJECT_H

#include "solver/formfactor/formfactor.h"
#include "solver/method/hierarchical/wavelet_basis.h"
#include "solver/method/hierarchical/wavelet_inverse.h"
#include "solver/method/hierarchical/wavelet_pass.h"
#include "solver/operator/blocks/plane_tree.h"
#include "solver/operator/wavelet/wavelet_plan.h"
#include "support/box_problem.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>

/* A mesh with form factors, its tree and basis. */
typedef struct subject {
    mesh m;
    csr F;
    uint32_t *order; /* of form_factors_make */
    double (*centre)[3];
    plane_tree tree;
    wavelets basis;
    wavelet_roots roots;
    wavelet_plan plan; /* of all coefficients */
    double *W;         /* [n][n], by its columns' positions; NULL until asked for */
} subject;

/* From SUBJECTS on, in the same sequence, their trees keep three parts apart that F joins. */
enum { BOX, ROOM, CITY, MAZE, SUBJECTS, PARTED = SUBJECTS, SUBJECTS_AND_PARTED = 2 * SUBJECTS, PARTS = 3 };

/* The part of an element of a parted subject. */
uint32_t wavelet_subject_part(const subject *s, size_t element);

void scene(subject *s, const char *kind, size_t elements);

wavelet_plan plan_of_all(const wavelets *basis);

subject wavelet_subject_make(int which);

void wavelet_subject_free(subject *s);

void transform(const subject *s, bool back, const float *from, float *to);

/* Column by column. */
const double *dense_W(subject *s);

/* W A W^T of a dense A by positions. */
double *in_basis(subject *s, const double *A);

/* S by positions. */
double *dense_S(const subject *s);

float *ones(const wavelets *w);

csr pass_of(const subject *s, const csr *F, bool one_sided, double reach, float threshold,
            const float *weight, size_t n_threads);

csr pass_within(const subject *s, double reach, float threshold, const float *weight, size_t n_threads);

csr pass(const subject *s, float threshold, const float *weight, size_t n_threads);

/* An upper triangle, its rows ascending, as a whole matrix. */
double *whole(const csr *upper);

double largest_difference(size_t count, const double *A, const double *B);

/* A transform rounds each number at most nine times a level, of at most 20: norms are 1. */
#define TRANSFORM_U (200 * FLT_EPSILON / 2)

#endif
