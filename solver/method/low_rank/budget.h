/* Shares the permitted error of a hierarchical factorization among the levels of its tree (after
 * Aguerre 2016, eq. 3.10). */
#ifndef LAMBERT_METHOD_LOW_RANK_BUDGET_H
#define LAMBERT_METHOD_LOW_RANK_BUDGET_H

#include <stdbool.h>

enum { BUDGET_LEVELS_MOST = 20 };

/* Why errors add in squares. Every node has Q = A V with V orthonormal: a leaf by its SVD, a parent because
 * Q = (Q1|Q2) V_r = A diag(V1, V2) V_r. With W = diag(V1, V2), what a node leaves out is
 *     A - Q V^T = A (I - W W^T) + (A W - A W V_r V_r^T) W^T:
 * the first part lets only what is orthogonal to W through, the second only what is in W. For any x, split as
 * x = y + W z with W^T y = 0, |(A - Q V^T) x| <= e_ch |y| + e_p |z| with e_p what its own truncation leaves,
 * and |y|^2 + |z|^2 = |x|^2, so |A - Q V^T|_2^2 <= e_p^2 + |A (I - W W^T)|_2^2 <= e_p^2 + e_1^2 + e_2^2 by
 * theorem 3.1 of Aguerre 2016; in the Frobenius norm both are equalities. Hence over all 2^l nodes of level l
 * that leave p_l each, sum_l 2^l p_l^2 <= epsilon^2 keeps the bound. (Aguerre 2016, eq. 3.10, adds e_p +
 * sqrt(2) e_ch in place of squares.) */
typedef struct budget {
    double alpha; /* the root's share of epsilon^2, in (0, 1) */
    /* The parts of the rest that levels l = 1 ... levels take; together 1. */
    double part[BUDGET_LEVELS_MOST + 1];
} budget;

/* Parts that fall by a ratio from level to level, but for the leaves where leaf > 0: those take it. */
void budget_divide(budget *b, int levels, double ratio, double leaf);

/* True if any level has a part. */
bool budget_divided(const budget *b);

/* p[l]: the error that a node of level l may leave, p[0] of the root to p[levels] of a leaf. */
void budget_share(const budget *b, double epsilon, int levels, double p[BUDGET_LEVELS_MOST + 1]);

#endif
