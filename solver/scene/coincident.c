#include "solver/scene/coincident.h"

#include "solver/base/union_find.h"
#include "solver/scene/coincident_cut.h"
#include "solver/scene/coincident_order.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Groups that a line names. */
enum { NAMED = 3 };

/* "floor 12, roof 3, 5 more": the groups of the largest numbers. numbers [n_groups] is spent. */
static void name_groups(const mesh *m, double *numbers, const char *unit, char *text, size_t size) {
    size_t left = 0, used = 0;
    text[0] = '\0';
    for (size_t g = 0; g < m->n_groups; g++) left += numbers[g] > 0;
    for (size_t k = 0; k < NAMED && left > 0; k++, left--) {
        size_t most = 0;
        for (size_t g = 1; g < m->n_groups; g++)
            if (numbers[g] > numbers[most]) most = g;
        used += (size_t)snprintf(text + used, size - used, "%s%.48s %.4g%s", k == 0 ? "" : ", ",
                                 m->group_names[most], numbers[most], unit);
        numbers[most] = 0;
    }
    if (left > 0) snprintf(text + used, size - used, ", %zu more", left);
}

/* Drops all but one face of each set of the same corners. */
static lam_status drop_repeated(mesh *m, const coincident_pairs *pairs, coincident_report *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    char groups[256], lost[96] = "";
    size_t first = m->n;
    bool *dropped = memory_allocate(m->n, sizeof *dropped, "repeated faces", error);
    uint32_t *set = memory_allocate(m->n, sizeof *set, "repeated faces", error);
    uint32_t *kept =
        memory_allocate(m->n, sizeof *kept, "repeated faces", error); /* of a set, by its first */
    double *numbers = memory_allocate(m->n_groups, sizeof *numbers, "repeated faces", error);
    if (dropped == NULL || set == NULL || kept == NULL || numbers == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t i = 0; i < m->n; i++) set[i] = kept[i] = i;
    for (size_t k = 0; k < pairs->n; k++)
        if (pairs->pairs[k].same) union_find_join(set, pairs->pairs[k].first, pairs->pairs[k].second);
    for (uint32_t i = 0; i < m->n; i++) {
        const uint32_t root = union_find_root(set, i);
        if (root != i && !coincident_face_emits(m, kept[root]) && coincident_face_emits(m, i)) kept[root] = i;
    }
    for (uint32_t i = 0; i < m->n; i++) {
        const uint32_t keeps = kept[union_find_root(set, i)];
        dropped[i] = keeps != i;
        if (!dropped[i]) continue;
        out->dropped++;
        out->differing += coincident_faces_differ(m, i, keeps);
        numbers[m->group[i]]++;
        if (first == m->n) first = i;
    }
    if (out->dropped == 0) goto done;
    double at[3];
    mesh_centroid(m, first, at);
    name_groups(m, numbers, "", groups, sizeof groups);
    if (out->differing > 0)
        snprintf(lost, sizeof lost, "; %zu of them %s another group or material than the one that is kept",
                 out->differing, out->differing == 1 ? "has" : "have");
    snprintf(
        out->dropped_line, sizeof out->dropped_line,
        "%zu face%s another one and %s dropped (%s; the first at %.6g %.6g %.6g m): of equal faces the first "
        "that emits is kept, or the first%s",
        out->dropped, out->dropped == 1 ? " repeats" : "s repeat", out->dropped == 1 ? "is" : "are", groups,
        at[0], at[1], at[2], lost);
    TRY(mesh_drop(m, dropped, error));
done:
    free(dropped);
    free(set);
    free(kept);
    free(numbers);
    return status;
}

static lam_status find_again(const mesh *m, coincident_sort sort, coincident_pairs *pairs, lam_error *error) {
    free(pairs->pairs);
    *pairs = (coincident_pairs){.n = 0};
    return coincident_pairs_find(m, sort, pairs, error);
}

/* Cuts faces so that each place belongs to one; *whole: some are as they were. */
static lam_status cut_overlapping(mesh *m, const coincident_pairs *pairs, coincident_report *out, bool *whole,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    char groups[256], gone[64] = "";
    coincident_cuts cuts = {.n = 0};
    TRY(coincident_cuts_find(m, pairs, &cuts, error));
    out->cut = cuts.cut;
    out->covered = cuts.covered;
    out->cut_area = cuts.area;
    *whole = cuts.whole > 0;
    if (cuts.cut + cuts.covered == 0) goto done;
    name_groups(m, cuts.lost, " m2", groups, sizeof groups);
    if (cuts.covered > 0) snprintf(gone, sizeof gone, "; nothing is left of %zu", cuts.covered);
    snprintf(
        out->cut_line, sizeof out->cut_line,
        "%zu face%s cut where others cover the same place, by %.4g m2 in all (%s; the first at %.6g %.6g "
        "%.6g m): the smaller surface keeps a place, of equal ones the first that emits, or the first%s",
        cuts.cut + cuts.covered, cuts.cut + cuts.covered == 1 ? " is" : "s are", cuts.area, groups,
        cuts.first[0], cuts.first[1], cuts.first[2], gone);
    TRY(coincident_cuts_make(m, &cuts, error));
done:
    coincident_cuts_free(&cuts);
    return status;
}

/* Names what overlaps nevertheless; *overlap [n_groups] are the shares of groups. */
static lam_status name_overlap(const mesh *m, const coincident_pairs *pairs, coincident_report *out,
                               double **overlap, lam_error *error) {
    lam_status status = LAM_OK;
    char groups[256];
    double first[3];
    double *shared = memory_allocate(m->n, sizeof *shared, "overlapping faces", error);
    double *area = memory_allocate(m->n_groups, sizeof *area, "overlapping faces", error);
    double *sums = memory_allocate(m->n_groups, sizeof *sums, "overlapping faces", error);
    if (shared == NULL || area == NULL || sums == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < pairs->n; k++) {
        shared[pairs->pairs[k].first] += pairs->pairs[k].area;
        shared[pairs->pairs[k].second] += pairs->pairs[k].area;
    }
    for (size_t i = 0; i < m->n; i++) {
        area[m->group[i]] += m->area[i];
        if (!(shared[i] > 0)) continue;
        if (out->overlapping++ == 0) mesh_centroid(m, i, first);
        sums[m->group[i]] += fmin(shared[i], m->area[i]);
    }
    if (out->overlapping == 0) goto done;
    for (size_t g = 0; g < m->n_groups; g++) {
        out->area += sums[g] / 2;
        area[g] = area[g] > 0 ? fmin(sums[g] / area[g], 1) : 0;
    }
    name_groups(m, sums, " m2", groups, sizeof groups);
    snprintf(
        out->overlap_line, sizeof out->overlap_line,
        "%zu faces overlap others in one plane, %s%.4g m2 in all (%s; the first at %.6g %.6g %.6g m): light "
        "counts twice there, and stated errors contain it; delete what is covered, or move it by %.2g m",
        out->overlapping, pairs->cut ? "at least " : "", out->area, groups, first[0], first[1], first[2],
        10 * coincident_planes_of(m).distance);
    *overlap = area;
    area = NULL;
done:
    free(shared);
    free(area);
    free(sums);
    return status;
}

lam_status mesh_settle_coincident(mesh *m, bool both_sides, coincident_report *out, lam_error *error) {
    lam_status status = LAM_OK;
    coincident_pairs pairs = {.n = 0};
    coincident_report found = {.dropped = 0};
    double *overlap = NULL;
    bool whole = false;
    const coincident_sort sort = both_sides ? COINCIDENT_BOTH_SIDES : COINCIDENT_ONE_SIDE;
    TRY(coincident_pairs_find(m, sort, &pairs, error));
    TRY(drop_repeated(m, &pairs, &found, error));
    if (found.dropped > 0) TRY(find_again(m, sort, &pairs, error));
    if (pairs.n > 0) TRY(cut_overlapping(m, &pairs, &found, &whole, error));
    if (whole || pairs.cut) {
        TRY(find_again(m, sort, &pairs, error));
        TRY(name_overlap(m, &pairs, &found, &overlap, error));
    }
    free(m->overlap);
    m->overlap = overlap;
    *out = found;
done:
    free(pairs.pairs);
    return status;
}

lam_status mesh_find_sheets(const mesh *m, double *shared, lam_error *error) {
    lam_status status = LAM_OK;
    coincident_pairs pairs = {.n = 0};
    const size_t n_fronts = m->n - m->n_backs;
    memset(shared, 0, m->n * sizeof *shared);
    TRY(coincident_pairs_find(m, COINCIDENT_SHEETS, &pairs, error));
    for (size_t k = 0; k < pairs.n; k++) {
        const coincident_pair *p = &pairs.pairs[k];
        if (p->second >= n_fronts) continue;
        shared[p->first] += p->area;
        shared[p->second] += p->area;
    }
done:
    free(pairs.pairs);
    return status;
}

double coincident_reach(const mesh *m) {
    return coincident_planes_of(m).reach;
}

/* Sums over one side of each face. */
static double overlap_sum(const mesh *m, double *all) {
    const size_t n = m->n - m->n_backs;
    double sum = 0, area = 0;
    for (size_t i = 0; i < n; i++) {
        area += m->area[i];
        if (m->overlap != NULL) sum += m->overlap[m->group[i]] * m->area[i];
    }
    *all = area;
    return sum;
}

double mesh_overlap_area(const mesh *m) {
    double all;
    return overlap_sum(m, &all) / 2;
}

double mesh_overlap_share(const mesh *m) {
    double all;
    const double sum = overlap_sum(m, &all);
    return all > 0 ? sum / all : 0;
}
