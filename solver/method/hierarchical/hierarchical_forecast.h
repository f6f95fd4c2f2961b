/* Time and memory that a hierarchical operator is going to take, from laws that were fitted to builds. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_HIERARCHICAL_FORECAST_H
#define LAMBERT_METHOD_HIERARCHICAL_HIERARCHICAL_FORECAST_H

#include "solver/method/method.h"

/* The share that the threshold of rows falls to, by the planes of the tree. */
double hierarchical_share_of_planes(double n, double planes);

/* As build_method.forecast, at an epsilon. */
void hierarchical_forecast(const method_scale *scale, double epsilon, method_forecast *out);

#endif
