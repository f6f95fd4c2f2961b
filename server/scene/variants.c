#include "server/scene/variants.h"
#include "server/scene/map_guard.h"

#include "solver/linalg/core.h"
#include "solver/operator/operator.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

/* A request for a variant, until it is served. */
typedef struct build {
    struct build *next;
    char *name;
    scene *base;        /* held; NULL once it has failed */
    float *reflectance; /* [C][n]; NULL once it has failed */
    char *groups;
    atomic_bool cancelled;
    problem why; /* of one that failed */
} build;

/* Order of locks: this one, then the catalog's. */
struct variants {
    const config *config;
    catalog *catalog;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    build *first;   /* waiting and failed builds in order of arrival; one of a name */
    build *running; /* or NULL */
    bool closed, has_thread;
    pthread_t thread;
};

static void build_free(build *b) {
    if (b == NULL) return;
    if (b->base != NULL) scene_release(b->base);
    free(b->reflectance);
    free(b->groups);
    free(b->name);
    free(b);
}

static void add(variants *v, build *b) {
    build **at = &v->first;
    while (*at != NULL) at = &(*at)->next;
    b->next = NULL;
    *at = b;
}

/* The place of the build of this name in the list, or (name NULL) of the first that waits; the end if there
 * is none. */
static build **find(variants *v, const char *name) {
    build **at = &v->first;
    while (*at != NULL && (name != NULL ? strcmp((*at)->name, name) != 0 : (*at)->base == NULL))
        at = &(*at)->next;
    return at;
}

static build *take(build **at) {
    build *b = *at;
    if (b != NULL) *at = b->next;
    return b;
}

static bool is_running(const variants *v, const char *name) {
    return v->running != NULL && !atomic_load(&v->running->cancelled) && strcmp(v->running->name, name) == 0;
}

/* True if another name would exceed --max-variants; served, waiting, running and failed ones count. */
static bool is_full(variants *v, const char *name) {
    catalog_snapshot *served = catalog_acquire(v->catalog);
    const scene *known = catalog_find(served, name);
    size_t count = 0;
    for (size_t i = 0; i < served->n_scenes; i++) count += served->scenes[i]->base != NULL;
    for (const build *b = v->first; b != NULL; b = b->next) count += catalog_find(served, b->name) == NULL;
    if (v->running != NULL && is_running(v, v->running->name))
        count += catalog_find(served, v->running->name) == NULL;
    catalog_release(served);
    return known == NULL && *find(v, name) == NULL && !is_running(v, name) &&
           count >= v->config->max_variants;
}

/* True if base is in the present snapshot. */
static bool is_served(const variants *v, const scene *base) {
    catalog_snapshot *present = catalog_acquire(v->catalog);
    const bool served = catalog_find(present, base->name) == base;
    catalog_release(present);
    return served;
}

static lam_status make(const variants *v, build *b, scene **out, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *op = NULL;
    if (!is_served(v, b->base)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    TRY(operator_relight(b->base->op, b->reflectance, &b->cancelled, &op, error));
    TRY(scene_open_variant(b->base, b->name, b->groups, op, out, error));
done:
    return status;
}

/* Keeps the reason of a failed build for clients. */
static void keep_failed(variants *v, build *b, lam_status status, const lam_error *error) {
    problem_set(&b->why,
                status == LAM_ERR_MEMORY     ? PROBLEM_NO_MEMORY
                : status == LAM_ERR_ARGUMENT ? PROBLEM_CONFLICT
                : status == LAM_ERR_NUMERIC  ? PROBLEM_BAD_VALUE
                                             : PROBLEM_INTERNAL,
                "%.200s could not be built: %.240s", b->name, scene_message(b->base, error->message));
    free(b->reflectance);
    b->reflectance = NULL;
    b->base = NULL;
    add(v, b);
}

static void *build_all(void *context) {
    variants *v = context;
    core_use_one_thread();
    map_guard_allow();
    /* Lowers the priority of this thread below those that solve, but not to the lowest: it holds locks that
     * others need. */
    (void)setpriority(PRIO_PROCESS, 0, 10);
    pthread_mutex_lock(&v->lock);
    for (;;) {
        while (!v->closed && *find(v, NULL) == NULL) pthread_cond_wait(&v->changed, &v->lock);
        if (v->closed) break;
        build *b = v->running = take(find(v, NULL));
        scene *base = b->base, *made = NULL;
        lam_error error = {.message = ""};
        pthread_mutex_unlock(&v->lock);
        lam_status status = make(v, b, &made, &error);
        pthread_mutex_lock(&v->lock);
        v->running = NULL;
        if (atomic_load(&b->cancelled)) status = LAM_ERR_CANCELLED;
        if (status == LAM_OK) {
            status = catalog_put_variant(v->catalog, made, &error);
            made = NULL;
        }
        const bool failed = status != LAM_OK && status != LAM_ERR_CANCELLED;
        if (failed) keep_failed(v, b, status, &error);
        pthread_mutex_unlock(&v->lock);
        if (made != NULL) scene_release(made);
        if (failed)
            scene_release(base);
        else
            build_free(b);
        pthread_mutex_lock(&v->lock);
    }
    pthread_mutex_unlock(&v->lock);
    return NULL;
}

lam_status variants_start(const config *c, catalog *all, variants **out, lam_error *error) {
    lam_status status = LAM_OK;
    variants *v = memory_allocate(1, sizeof *v, "variants", error);
    if (v == NULL) return LAM_ERR_MEMORY;
    v->config = c;
    v->catalog = all;
    pthread_mutex_init(&v->lock, NULL);
    pthread_cond_init(&v->changed, NULL);
    v->has_thread = c->max_variants > 0 && pthread_create(&v->thread, NULL, build_all, v) == 0;
    if (c->max_variants > 0 && !v->has_thread)
        FAIL(error, LAM_ERR_MEMORY, "the thread that builds variants cannot start");
    *out = v;
    v = NULL;
done:
    variants_destroy(v);
    return status;
}

void variants_close(variants *v) {
    pthread_mutex_lock(&v->lock);
    v->closed = true;
    if (v->running != NULL) atomic_store(&v->running->cancelled, true);
    pthread_cond_broadcast(&v->changed);
    pthread_mutex_unlock(&v->lock);
}

bool variants_busy(variants *v) {
    pthread_mutex_lock(&v->lock);
    const bool busy = v->running != NULL;
    pthread_mutex_unlock(&v->lock);
    return busy;
}

void variants_destroy(variants *v) {
    if (v == NULL) return;
    variants_close(v);
    if (v->has_thread) pthread_join(v->thread, NULL);
    while (v->first != NULL) build_free(take(&v->first));
    pthread_cond_destroy(&v->changed);
    pthread_mutex_destroy(&v->lock);
    free(v);
}

static build *build_create(scene *base, const char *name, float *reflectance, const char *groups) {
    build *b = calloc(1, sizeof *b);
    if (b == NULL) {
        free(reflectance);
        return NULL;
    }
    atomic_init(&b->cancelled, false);
    b->base = scene_acquire(base);
    b->reflectance = reflectance;
    b->name = strdup(name);
    b->groups = strdup(groups);
    if (b->name != NULL && b->groups != NULL) return b;
    build_free(b);
    return NULL;
}

bool variants_put(variants *v, scene *base, const char *name, float *reflectance, const char *groups,
                  problem *why) {
    build *b = build_create(base, name, reflectance, groups), *dropped = NULL;
    if (b == NULL) return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for a variant");
    catalog_snapshot *served = catalog_acquire(v->catalog);
    const scene *known = catalog_find(served, name);
    const bool taken = known != NULL && known->base == NULL;
    catalog_release(served);
    bool good = false;
    pthread_mutex_lock(&v->lock);
    if (taken) {
        problem_set(why, PROBLEM_CONFLICT, "the name %.200s is taken by a store; choose another", name);
    } else if (v->closed) {
        problem_set(why, PROBLEM_UNAVAILABLE, "shutting down");
    } else if (is_full(v, name)) {
        problem_set(why, PROBLEM_TOO_MANY_VARIANTS,
                    "there are %zu variants already (--max-variants); DELETE one", v->config->max_variants);
    } else {
        dropped = take(find(v, name));
        if (is_running(v, name)) atomic_store(&v->running->cancelled, true);
        add(v, b);
        b = NULL;
        good = true;
        pthread_cond_broadcast(&v->changed);
    }
    pthread_mutex_unlock(&v->lock);
    build_free(dropped);
    build_free(b);
    return good;
}

bool variants_remove(variants *v, const char *name, problem *why) {
    lam_error error = {.message = ""};
    pthread_mutex_lock(&v->lock);
    build *dropped = take(find(v, name));
    const bool running = is_running(v, name);
    if (running) atomic_store(&v->running->cancelled, true);
    const lam_status status = catalog_remove_variant(v->catalog, name, &error);
    pthread_mutex_unlock(&v->lock);
    const bool found = dropped != NULL || running || status == LAM_OK;
    build_free(dropped);
    if (status == LAM_ERR_MEMORY)
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to take %.200s out", name);
    return found || problem_set(why, PROBLEM_NOT_FOUND, "there is no variant %.200s", name);
}

variant_state variants_state(variants *v, const char *name, problem *why) {
    variant_state state = VARIANT_SETTLED;
    if (strchr(name, '@') == NULL) return state;
    pthread_mutex_lock(&v->lock);
    const build *b = *find(v, name);
    if (b != NULL && b->base == NULL) {
        state = VARIANT_FAILED;
        *why = b->why;
    } else if (b != NULL || is_running(v, name)) {
        state = VARIANT_BUILDING;
    }
    pthread_mutex_unlock(&v->lock);
    return state;
}
