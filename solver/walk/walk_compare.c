/* Comparisons with estimates by walks. */
#include "solver/walk/walk.h"

#include <math.h>

/* Below this number of visits the error of an estimate depends too much on its own value. */
enum { VISITS_ENOUGH = 100 };

double walk_score(const walk_estimates *e, size_t k, double value, double value_error) {
    const size_t t = k % e->n_targets, r = k / e->n_targets / e->n_channels;
    const double visit = e->largest[k] / (double)e->walks;
    double variance = e->error[k] * e->error[k];
    /* Rare visits are Poisson's: a mean of value is value / visit of them, whose variance is value * visit.
     */
    if (e->visits[r * e->n_targets + t] < VISITS_ENOUGH) variance = fmax(variance, value * visit);
    variance += visit * visit + value_error * value_error;
    const double difference = value - e->mean[k];
    return difference == 0 ? 0 : difference / sqrt(variance);
}

/* P(|T| >= x) of Student's distribution with an odd number of degrees of freedom, by its finite sum
 * (Abramowitz and Stegun 26.7.3). */
static double student_tails(double x, int freedom) {
    const double angle = atan(x / sqrt(freedom)), cosine2 = cos(angle) * cos(angle);
    double term = sin(angle) * cos(angle), sum = angle + term;
    for (int k = 3; k < freedom; k += 2) {
        term *= cosine2 * (k - 1) / k;
        sum += term;
    }
    return fmax(0, 1 - sum * 2 / M_PI);
}

double walk_chance(double score, size_t comparisons) {
    const double one = student_tails(fabs(score), WALK_BATCHES - 1);
    return -expm1((double)comparisons * log1p(-one));
}
