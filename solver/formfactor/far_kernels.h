/* The inner loop of far.c, included there once for each instruction set, which defines
 *   KERNEL(name) TARGET   the name and the attribute of its functions
 *   lane mask             vectors of doubles, and of integers as wide, for comparisons */

#define LANES (sizeof(lane) / sizeof(double))

TARGET static inline __attribute__((always_inline)) lane KERNEL(load)(const double *from) {
    lane x;
    __builtin_memcpy(&x, from, sizeof x);
    return x;
}

/* Corners of the vector of elements at j in relation to the plane of element i, or the reverse: which lie
 * behind it by more than rounding, and whether any lies in front. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(sides)(const far_table *t, size_t i, size_t j, lane rounding, mask *behind, mask *in_front) {
    mask any_behind_i = {0}, any_front_i = {0}, any_behind_j = {0}, any_front_j = {0};
    for (int c = 0; c < 4; c++) {
        lane of_j = {0}, of_i = {0};
        for (int d = 0; d < 3; d++) {
            of_j += (KERNEL(load)(t->corner[c][d] + j) - t->centre[d][i]) * t->normal[d][i];
            of_i += (t->corner[c][d][i] - KERNEL(load)(t->centre[d] + j)) * KERNEL(load)(t->normal[d] + j);
        }
        any_behind_j |= of_j < -rounding;
        any_front_j |= of_j > rounding;
        any_behind_i |= of_i < -rounding;
        any_front_i |= of_i > rounding;
    }
    *behind = any_behind_i | any_behind_j;
    *in_front = any_front_i & any_front_j;
}

/* A F = integral integral cos cos' / (pi r^2), sums over the points of both. */
TARGET static inline __attribute__((always_inline)) lane
KERNEL(kernel_sum)(const far_table *t, const far_rule_points *rule, size_t i, size_t j, int points) {
    const lane n_x = KERNEL(load)(t->normal[0] + j), n_y = KERNEL(load)(t->normal[1] + j),
               n_z = KERNEL(load)(t->normal[2] + j);
    lane sum = {0};
    for (int q = 0; q < points; q++) {
        const lane p_x = KERNEL(load)(rule->point[q][0] + j), p_y = KERNEL(load)(rule->point[q][1] + j),
                   p_z = KERNEL(load)(rule->point[q][2] + j);
        lane part = {0};
        for (int p = 0; p < points; p++) {
            const lane x = p_x - rule->point[p][0][i], y = p_y - rule->point[p][1][i],
                       z = p_z - rule->point[p][2][i];
            const lane r2 = x * x + y * y + z * z;
            part -= rule->weight[p][i] * (x * t->normal[0][i] + y * t->normal[1][i] + z * t->normal[2][i]) *
                    (x * n_x + y * n_y + z * n_z) / (r2 * r2);
        }
        sum += KERNEL(load)(rule->weight[q] + j) * part;
    }
    return sum;
}

/* Lanes whose elements are closer to element i than a rule allows. */
TARGET static inline __attribute__((always_inline)) mask
KERNEL(too_close)(const far_table *t, size_t i, lane apart2, lane radius, double closest) {
    const double of_i = closest * t->radius[i];
    return (apart2 < of_i * of_i) | (apart2 < closest * closest * radius * radius);
}

TARGET static inline __attribute__((always_inline)) bool KERNEL(any)(mask m) {
    long long bits = 0;
    for (size_t k = 0; k < LANES; k++) bits |= m[k];
    return bits != 0;
}

TARGET static void KERNEL(far_row)(const far_table *t, size_t i, size_t first, size_t count, double *g) {
    for (size_t k = 0; k < count; k += LANES) {
        const size_t j = first + k;
        lane apart2 = {0};
        for (int d = 0; d < 3; d++) {
            const lane r = KERNEL(load)(t->centre[d] + j) - t->centre[d][i];
            apart2 += r * r;
        }
        const lane radius = KERNEL(load)(t->radius + j);
        mask behind, in_front, close;
        lane sum;
        KERNEL(sides)(t, i, j, 1e-12 * (radius + t->radius[i]), &behind, &in_front);
        close = KERNEL(too_close)(t, i, apart2, radius, t->rule[0].closest);
        if (!KERNEL(any)(close & in_front)) {
            sum = KERNEL(kernel_sum)(t, &t->rule[0], i, j, 4);
        } else {
            close = KERNEL(too_close)(t, i, apart2, radius, t->rule[1].closest);
            sum = KERNEL(kernel_sum)(t, &t->rule[1], i, j, 9);
        }
        close |= behind;
        for (size_t lane_at = 0; lane_at < LANES && k + lane_at < count; lane_at++) {
            const double value = sum[lane_at];
            g[k + lane_at] = in_front[lane_at] == 0 ? 0 : close[lane_at] != 0 ? -1 : value > 0 ? value : 0;
        }
    }
}

#undef LANES
