#include "solver/formfactor/pairs/cluster_links.h"

#include "solver/base/array_grow.h"
#include "solver/base/clock.h"
#include "solver/formfactor/clusters/cluster_shaft.h"
#include "solver/formfactor/sight/open_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The links that one task has found. */
typedef struct bag {
    cluster_link *links;
    size_t n, capacity;
    double hidden_pairs, distant_pairs;
    cluster_link_work work;
    bool out_of_memory;
} bag;

typedef struct walk {
    const mesh *m;
    const cluster_tree *t;
    const occlusion *o;
    const cluster_link_options *options;
    bag *found;
} walk;

void cluster_links_free(cluster_links *l) {
    free(l->links);
    free(l->of_cluster);
    *l = (cluster_links){0};
}

static void bag_add(bag *b, uint32_t a, uint32_t c, bool open) {
    if (array_grow(&b->links, &b->capacity, b->n + 1, sizeof *b->links, "cluster links", NULL) != LAM_OK) {
        b->out_of_memory = true;
        return;
    }
    b->links[b->n++] = (cluster_link){a, c, open};
}

static double pairs_between(const cluster *a, const cluster *b) {
    return (double)(a->last - a->first) * (double)(b->last - b->first);
}

static double extent2(const cluster *c) {
    double sum = 0;
    for (int d = 0; d < 3; d++) sum += (c->high[d] - c->low[d]) * (c->high[d] - c->low[d]);
    return sum;
}

/* A bound on the factor from a point to an area at distance d: A / (pi d^2), at most 1. */
static double factor_bound(double area, double distance2) {
    const double apart = 3.14159265358979323846 * distance2;
    return area < apart ? area / apart : 1;
}

typedef enum cluster_state { CLUSTERS_OPEN, CLUSTERS_HIDDEN, CLUSTERS_MIXED } cluster_state;

/* Two clusters with elements in their shaft are open where no occluder is between them, and hidden where one
 * covers them or, where there are too many to know, where all segments are blocked. */
static cluster_state look_between(walk *w, const cluster *a, const cluster *b, const shaft *s,
                                  double distance2) {
    const bool near = w->options->threshold > 0;
    if (w->options->occluders != NULL) {
        link_occluders among;
        link_occluders_find(w->options->occluders, s, a, b, link_occluders_projected(w->options->occluders),
                            &among);
        if (among.count == 0) return CLUSTERS_OPEN;
        if (among.count > 0)
            return !near && link_occluders_hide(w->options->occluders, &among, a, b) ? CLUSTERS_HIDDEN
                                                                                     : CLUSTERS_MIXED;
    }
    /* The near field has so few pairs that testing each is cheaper than testing clusters. */
    if (near) return CLUSTERS_MIXED;
    w->found->work.occlusion++;
    if (!occlusion_is_total(w->o, w->t, a, b, factor_bound(fmax(a->area, b->area), distance2)))
        return CLUSTERS_MIXED;
    w->found->work.hidden++;
    return CLUSTERS_HIDDEN;
}

/* With more candidates than this, the shaft between two leaves of the near field is not built. */
enum { CROWD = 16 };

/* Links a pair of clusters, drops it, or descends into its children. */
static void visit(walk *w, uint32_t a, uint32_t b, const uint32_t *candidates, size_t n_candidates) {
    const cluster_tree *t = w->t;
    const cluster *one = &t->clusters[a], *two = &t->clusters[b];
    if (w->found->out_of_memory) return;
    if (a == b) {
        if (one->plane) return;
        if (cluster_is_leaf(one)) {
            bag_add(w->found, a, a, n_candidates == 0);
            return;
        }
        visit(w, one->child[0], one->child[0], candidates, n_candidates);
        visit(w, one->child[0], one->child[1], candidates, n_candidates);
        visit(w, one->child[1], one->child[1], candidates, n_candidates);
        return;
    }
    if (cluster_faces_away(one, two, w->options->slack)) return;
    const double distance2 = cluster_distance2(one, two);
    const double mean_area = 2 / (1 / one->largest + 1 / two->largest);
    if (factor_bound(mean_area, distance2) < w->options->threshold) {
        w->found->distant_pairs += pairs_between(one, two);
        return;
    }
    const bool near = w->options->threshold > 0;
    const bool leaves = cluster_is_leaf(one) && cluster_is_leaf(two);
    /* A shaft with so many candidates is seldom empty. */
    if (near && leaves && n_candidates > CROWD) {
        bag_add(w->found, a, b, false);
        return;
    }
    uint32_t within[SHAFT_CANDIDATES];
    shaft s;
    cluster_shaft_init(&s, one, two, w->options->slack);
    const size_t n_within = cluster_shaft_filter(&s, w->m, t, candidates, n_candidates, leaves, within);
    w->found->work.shafts++;
    w->found->work.candidates += (double)(n_candidates + n_within);
    /* With a threshold even an open link descends to the leaves: some of its pairs may be below it. */
    if (n_within == 0 && (!near || leaves)) {
        bag_add(w->found, a, b, true);
        return;
    }
    const cluster_state between =
        n_within > 0 && (!near || leaves) ? look_between(w, one, two, &s, distance2) : CLUSTERS_MIXED;
    if (between == CLUSTERS_OPEN) {
        bag_add(w->found, a, b, true);
        return;
    }
    if (between == CLUSTERS_HIDDEN) {
        w->found->hidden_pairs += pairs_between(one, two);
        return;
    }
    if (leaves) {
        bag_add(w->found, a, b, false);
        return;
    }
    const bool split_one = !cluster_is_leaf(one) && (cluster_is_leaf(two) || extent2(one) >= extent2(two));
    for (int k = 0; k < 2; k++)
        visit(w, split_one ? one->child[k] : a, split_one ? b : two->child[k], within, n_within);
}

typedef struct task {
    uint32_t a, b;
} task;

/* Parts of a descent; those that a sample is drawn from, so small that a few hundred stand for all. */
enum { TASKS_WANTED = 1024, TASKS_TO_SAMPLE = 32768 };

/* Splits the descent into about as many pairs of clusters as wanted, which threads take one by one: those
 * with a leaf, and then the others. tasks has room for wanted + 2, queue for 3 (wanted + 2). */
static size_t make_tasks(const cluster_tree *t, size_t wanted, task *tasks, task *queue) {
    size_t n = 0, head = 0, tail = 1;
    queue[0] = (task){0, 0};
    while (head < tail && n + (tail - head) + 2 <= wanted) {
        const task now = queue[head++];
        const cluster *a = &t->clusters[now.a], *b = &t->clusters[now.b];
        if (cluster_is_leaf(a) || cluster_is_leaf(b)) {
            tasks[n++] = now;
        } else if (now.a == now.b) {
            queue[tail++] = (task){a->child[0], a->child[0]};
            queue[tail++] = (task){a->child[0], a->child[1]};
            queue[tail++] = (task){a->child[1], a->child[1]};
        } else {
            const bool split_a = extent2(a) >= extent2(b);
            for (int k = 0; k < 2; k++)
                queue[tail++] = (task){split_a ? a->child[k] : now.a, split_a ? now.b : b->child[k]};
        }
    }
    while (head < tail) tasks[n++] = queue[head++];
    return n;
}

/* Sorts the links of all tasks by a. */
static lam_status gather(const cluster_tree *t, const bag *bags, size_t n_bags, cluster_links *out,
                         lam_error *error) {
    lam_status status = LAM_OK;
    cluster_links l = {.share = 1};
    size_t *next = NULL;
    for (size_t k = 0; k < n_bags; k++) {
        if (bags[k].out_of_memory) FAIL(error, LAM_ERR_MEMORY, "links of clusters: out of memory");
        l.n += bags[k].n;
        l.hidden_pairs += bags[k].hidden_pairs;
        l.distant_pairs += bags[k].distant_pairs;
        l.work.shafts += bags[k].work.shafts;
        l.work.candidates += bags[k].work.candidates;
        l.work.occlusion += bags[k].work.occlusion;
        l.work.hidden += bags[k].work.hidden;
        l.work.seconds += bags[k].work.seconds;
    }
    l.links = memory_allocate(l.n, sizeof *l.links, "links of clusters", error);
    l.of_cluster = memory_allocate(t->n_clusters + 1, sizeof *l.of_cluster, "links of clusters", error);
    next = memory_allocate(t->n_clusters + 1, sizeof *next, "links of clusters", error);
    if (l.links == NULL || l.of_cluster == NULL || next == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_bags; k++)
        for (size_t p = 0; p < bags[k].n; p++) l.of_cluster[bags[k].links[p].a + 1]++;
    for (size_t c = 0; c < t->n_clusters; c++) l.of_cluster[c + 1] += l.of_cluster[c];
    memcpy(next, l.of_cluster, (t->n_clusters + 1) * sizeof *next);
    for (size_t k = 0; k < n_bags; k++)
        for (size_t p = 0; p < bags[k].n; p++) l.links[next[bags[k].links[p].a]++] = bags[k].links[p];
    *out = l;
    l = (cluster_links){0};
done:
    free(next);
    cluster_links_free(&l);
    return status;
}

/* Runs one task, a part of the descent, and measures its time. The tasks of a sample are many and small. The
 * whole descent comes to such a task with the occluders near its shaft, which it has found above; here they
 * are found from the root on. The clock starts after that, as the whole descent does not do this work for
 * every task. */
static void run_task(walk *w, const task *of, size_t n_candidates) {
    static const uint32_t root = 0;
    uint32_t within[SHAFT_CANDIDATES];
    const uint32_t *candidates = &root;
    if (w->options->one_of > 1 && of->a != of->b && n_candidates > 0) {
        shaft s;
        cluster_shaft_init(&s, &w->t->clusters[of->a], &w->t->clusters[of->b], w->options->slack);
        n_candidates = cluster_shaft_filter(&s, w->m, w->t, candidates, n_candidates, false, within);
        candidates = within;
    }
    const double started = clock_thread_seconds();
    visit(w, of->a, of->b, candidates, n_candidates);
    w->found->work.seconds = clock_thread_seconds() - started;
}

lam_status cluster_links_find(const mesh *m, const cluster_tree *t, const occlusion *o,
                              const cluster_link_options *options, cluster_links *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t step = options->one_of > 1 ? options->one_of : 1;
    const size_t wanted = step > 1 ? TASKS_TO_SAMPLE : TASKS_WANTED;
    size_t n_tasks = 0, n_bags = 0;
    bag *bags = NULL;
    task *tasks = memory_allocate(4 * (wanted + 2), sizeof *tasks, "links of clusters", error);
    if (tasks == NULL) return LAM_ERR_MEMORY;
    n_tasks = make_tasks(t, wanted, tasks, tasks + wanted + 2);
    n_bags = (n_tasks - step / 2 + step - 1) / step;
    bags = memory_allocate(n_bags, sizeof *bags, "links of clusters", error);
    if (bags == NULL) TRY(LAM_ERR_MEMORY);
    bool cancelled = false;
    const size_t n_candidates = clusters_hide_nothing(m, t) ? 0 : 1;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < n_bags; k++) {
        bool stop;
#pragma omp atomic read
        stop = cancelled;
        if (stop) continue;
        walk w = {.m = m, .t = t, .o = o, .options = options, .found = &bags[k]};
        run_task(&w, &tasks[step / 2 + k * step], n_candidates);
        if (progress_cancelled(options->progress)) {
#pragma omp atomic write
            cancelled = true;
        }
    }
    if (cancelled) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    TRY(gather(t, bags, n_bags, out, error));
    out->share = (double)n_bags / (double)n_tasks;
done:
    for (size_t k = 0; bags != NULL && k < n_bags; k++) free(bags[k].links);
    free(bags);
    free(tasks);
    return status;
}
