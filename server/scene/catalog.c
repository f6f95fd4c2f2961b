/* A reload builds a new snapshot and replaces the present one under the lock; readers hold references. A
 * scene is served if memory + computed + work areas <= --max-memory, summed over all scenes, with work areas
 * = threads times the largest one; where it does not fit, what was computed is dropped first. */
#include "server/scene/catalog.h"

#include "server/scene/log_line.h"
#include "server/scene/refusals.h"
#include "server/scene/sources.h"
#include "server/scene/verifier.h"
#include "solver/base/array_grow.h"

#include <malloc.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct catalog {
    const config *config;
    FILE *out, *problems;
    memory_ledger ledger;
    verifier *verifier;
    pthread_mutex_t lock; /* of present */
    catalog_snapshot *present;
    uint64_t n_variants; /* made so far */
    atomic_bool read_all;
};

/* The scenes in service are to be compared again. */
static void list_again(void *context, verifier *v) {
    catalog_snapshot *now = catalog_acquire(context);
    for (size_t i = 0; i < now->n_scenes; i++) verifier_add_again(v, now->scenes[i]);
    catalog_release(now);
}

/* Without scenes, with room for so many. */
static lam_status snapshot_create(size_t most, catalog_snapshot **out, lam_error *error) {
    lam_status status = LAM_OK;
    catalog_snapshot *made = memory_allocate(1, sizeof *made, "catalog", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    atomic_init(&made->references, 1);
    TRY(scene_list_create(&made->list, error));
    made->refused = refusals_create();
    if (made->refused == NULL) FAIL(error, LAM_ERR_MEMORY, "catalog: not enough memory");
    made->scenes = memory_allocate(most, sizeof *made->scenes, "catalog", error);
    if (made->scenes == NULL) TRY(LAM_ERR_MEMORY);
    *out = made;
    made = NULL;
done:
    catalog_release(made);
    return status;
}

lam_status catalog_create(const config *c, FILE *out, FILE *problems, catalog **made, lam_error *error) {
    lam_status status = LAM_OK;
    catalog_snapshot *empty = NULL;
    catalog *all = memory_allocate(1, sizeof *all, "catalog", error);
    if (all == NULL) TRY(LAM_ERR_MEMORY);
    TRY(snapshot_create(0, &empty, error));
    all->config = c;
    atomic_init(&all->ledger.taken, 0);
    atomic_init(&all->read_all, false);
    atomic_init(&all->ledger.room, 0); /* until the memory of the stores is known */
    all->out = out;
    all->problems = problems;
    const verifier_scrub scrub = {.hours = c->scrub_hours, .list = list_again, .context = all};
    pthread_mutex_init(&all->lock, NULL);
    all->present = empty;
    TRY(verifier_start(out, problems, &scrub, &all->verifier, error));
    empty = NULL;
    *made = all;
    all = NULL;
done:
    free(all);
    catalog_release(empty);
    return status;
}

void catalog_destroy(catalog *all) {
    if (all == NULL) return;
    verifier_stop(all->verifier);
    catalog_release(all->present);
    pthread_mutex_destroy(&all->lock);
    free(all);
}

catalog_snapshot *catalog_acquire(catalog *all) {
    pthread_mutex_lock(&all->lock);
    catalog_snapshot *snapshot = all->present;
    atomic_fetch_add(&snapshot->references, 1);
    pthread_mutex_unlock(&all->lock);
    return snapshot;
}

void catalog_release(catalog_snapshot *snapshot) {
    if (snapshot == NULL || atomic_fetch_sub(&snapshot->references, 1) != 1) return;
    for (size_t i = 0; i < snapshot->n_scenes; i++) scene_release(snapshot->scenes[i]);
    refusals_release(snapshot->refused);
    free(snapshot->scenes);
    scene_list_destroy(snapshot->list);
    free(snapshot);
}

static int compare_to_name(const void *name, const void *entry) {
    return strcmp(name, (*(scene *const *)entry)->name);
}

const scene *catalog_find(const catalog_snapshot *snapshot, const char *name) {
    if (snapshot->n_scenes == 0) return NULL;
    scene *const *found =
        bsearch(name, snapshot->scenes, snapshot->n_scenes, sizeof *snapshot->scenes, compare_to_name);
    return found == NULL ? NULL : *found;
}

/* The scene that was read from this source before, or NULL. */
static scene *find_before(const catalog_snapshot *before, const source *from) {
    for (size_t i = 0; i < before->n_scenes; i++) {
        scene *s = before->scenes[i];
        if (s->base == NULL && strcmp(s->path, from->path) == 0 && strcmp(s->name, from->name) == 0) return s;
    }
    return NULL;
}

/* Inserts s by its name; returns the scene that has this name already, else NULL. */
static const scene *insert(catalog_snapshot *snapshot, scene *s) {
    size_t at = 0;
    while (at < snapshot->n_scenes && strcmp(snapshot->scenes[at]->name, s->name) < 0) at++;
    if (at < snapshot->n_scenes && strcmp(snapshot->scenes[at]->name, s->name) == 0)
        return snapshot->scenes[at];
    memmove(snapshot->scenes + at + 1, snapshot->scenes + at,
            (snapshot->n_scenes - at) * sizeof *snapshot->scenes);
    snapshot->scenes[at] = s;
    snapshot->n_scenes++;
    return NULL;
}

/* Memory of the scenes of a snapshot, and their largest work area of a thread. */
static uint64_t memory_used(const catalog_snapshot *snapshot, size_t *work_bytes) {
    uint64_t used = 0;
    *work_bytes = 0;
    for (size_t i = 0; i < snapshot->n_scenes; i++) {
        const scene *s = snapshot->scenes[i];
        used += s->memory;
        if (s->work_bytes > *work_bytes) *work_bytes = s->work_bytes;
    }
    return used;
}

/* Memory that they have taken since they were opened. */
static uint64_t memory_grown(const catalog_snapshot *snapshot) {
    uint64_t grown = 0;
    for (size_t i = 0; i < snapshot->n_scenes; i++) grown += scene_grown(snapshot->scenes[i]);
    return grown;
}

/* The rest of --max-memory beside the scenes, their work areas and `grown`. */
static uint64_t memory_left(const catalog *all, const catalog_snapshot *next, uint64_t grown) {
    size_t work_bytes;
    const uint64_t used =
        memory_used(next, &work_bytes) + scene_work_memory(all->config->threads, work_bytes) + grown;
    if (all->config->max_memory == 0) return UINT64_MAX;
    return all->config->max_memory > used ? all->config->max_memory - used : 0;
}

/* The ledger gets the rest of --max-memory. */
static void share_memory(catalog *all, const catalog_snapshot *present) {
    const uint64_t left = memory_left(all, present, 0);
    atomic_store(&all->ledger.room, left < SIZE_MAX ? (size_t)left : SIZE_MAX);
}

/* Checks that an open scene fits into --max-memory with its work areas, which all scenes share. */
static lam_status check_work(const catalog *all, const catalog_snapshot *next, const scene *s,
                             lam_error *error) {
    const size_t threads = all->config->threads;
    size_t work_bytes;
    const uint64_t used = memory_used(next, &work_bytes) + memory_grown(next);
    if (s->work_bytes > work_bytes) work_bytes = s->work_bytes;
    const uint64_t wanted = used + s->memory + scene_grown(s) + scene_work_memory(threads, work_bytes);
    if (all->config->max_memory == 0 || wanted <= all->config->max_memory) return LAM_OK;
    return status_fail(
        error, LAM_ERR_MEMORY,
        "%s: takes %llu bytes, and %zu threads %zu each to solve, of --max-memory %zu the other "
        "stores have %llu",
        s->path, (unsigned long long)s->memory, threads, work_bytes, all->config->max_memory,
        (unsigned long long)used);
}

static void drop_all_computed(const catalog_snapshot *next) {
    for (size_t i = 0; i < next->n_scenes; i++) scene_drop_computed(next->scenes[i]);
}

/* The same, where rows of reductions and meshes go before the scene does: its own, which it may have where it
 * is served already, then those of others. */
static lam_status check_kept(const catalog *all, const catalog_snapshot *next, const scene *s,
                             lam_error *error) {
    lam_error unused;
    if (check_work(all, next, s, &unused) == LAM_OK) return LAM_OK;
    scene_drop_computed(s);
    if (check_work(all, next, s, &unused) == LAM_OK) return LAM_OK;
    drop_all_computed(next);
    return check_work(all, next, s, error);
}

/* A message that says how a file that is no store, or a folder, was meant: a store is called NAME.h5 nearly
 * always. */
static lam_status explain_foreign(const source *from, lam_error *error) {
    struct stat file;
    const size_t length = strlen(from->path);
    const bool known = stat(from->path, &file) == 0;
    if (known && S_ISDIR(file.st_mode))
        return status_fail(error, LAM_ERR_FORMAT, "%s: a folder; --stores %s serves the stores in it",
                           from->path, from->path);
    if (known && S_ISREG(file.st_mode) && (length < 3 || strcmp(from->path + length - 3, ".h5") != 0))
        return status_fail(
            error, LAM_ERR_FORMAT,
            "%s: not a Lambert store; if it is a scene, precompute it first: lambert precompute %s -o %s.h5",
            from->path, from->path, from->name);
    return LAM_ERR_FORMAT;
}

/* Opens the store of a source and checks its memory. */
static lam_status open_source(catalog *all, const catalog_snapshot *next, const source *from, scene *old,
                              const stop_check *stop, scene **out, lam_error *error) {
    lam_status status = LAM_OK;
    scene *opened = NULL;
    /* A store that was damaged is verified as a whole first. */
    const bool verify = all->config->verify || (old != NULL && scene_damaged(old, NULL, NULL));
    scene_options options = {.path = from->path,
                             .name = from->name,
                             .verify = verify,
                             .verify_below = all->config->verify_below,
                             .memory = memory_left(all, next, memory_grown(next)),
                             .ledger = &all->ledger,
                             .before = old,
                             .threads = all->config->threads,
                             .stop = stop};
    status = scene_open(&options, &opened, error);
    if (status == LAM_ERR_MEMORY && memory_grown(next) > 0) {
        drop_all_computed(next);
        options.memory = memory_left(all, next, memory_grown(next));
        status = scene_open(&options, &opened, error);
    }
    if (status == LAM_ERR_FORMAT) status = explain_foreign(from, error);
    TRY(status);
    TRY(check_kept(all, next, opened, error));
    *out = opened;
    opened = NULL;
done:
    if (opened != NULL) scene_release(opened);
    return status;
}

/* A name that clients can put into a path, which they shorten by "." and "..", and in which proxies and
 * clients take escaped slashes and control characters for others, or refuse them. */
static lam_status check_name(const source *from, lam_error *error) {
    const size_t length = strlen(from->name);
    bool plain = strcmp(from->name, ".") != 0 && strcmp(from->name, "..") != 0;
    for (const char *c = from->name; *c != '\0'; c++)
        plain = plain && (unsigned char)*c >= ' ' && *c != 0x7f && *c != '/';
    if (!plain)
        return status_fail(
            error, LAM_ERR_ARGUMENT,
            "%s: no client can ask for a scene called \"%s\" (a name is not . or .., and has no slash and "
            "no control character); rename the file, or give it another name: STORE:NAME",
            from->path, from->name);
    if (length >= CATALOG_NAME_MAX)
        return status_fail(
            error, LAM_ERR_ARGUMENT,
            "%s: the name has %zu bytes, at most %d can be asked for; give it another: STORE:NAME",
            from->path, length, CATALOG_NAME_MAX - 1);
    return LAM_OK;
}

/* reason: for clients, where the message has the path of another store; or NULL. */
static void refuse(catalog *all, catalog_snapshot *next, const source *from, const lam_error *error,
                   const char *reason) {
    /* Most messages begin with the path, some (out of memory) do not. */
    lam_error path;
    (void)status_fail(&path, LAM_OK, "%s", from->path); /* as a message has it */
    const bool named = strncmp(error->message, path.message, strlen(path.message)) == 0;
    log_line(all->problems, "refused %s%s%s", named ? "" : from->path, named ? "" : ": ", error->message);
    refusals_add(next->refused, from->path, from->name, reason != NULL ? reason : error->message, false);
}

static void load_source(catalog *all, catalog_snapshot *next, const catalog_snapshot *before,
                        const source *from, const stop_check *stop) {
    lam_error error = {0};
    scene *loaded = NULL, *old = find_before(before, from);
    const scene *taken = catalog_find(next, from->name);
    lam_status status = check_name(from, &error);
    if (status == LAM_OK && taken != NULL)
        status =
            status_fail(&error, LAM_ERR_ARGUMENT,
                        "%s: the name %s is taken by %s; rename the file, or give the scene another name: "
                        "STORE:NAME",
                        from->path, from->name, taken->path);
    if (status != LAM_OK) {
        refuse(all, next, from, &error, taken != NULL ? "another store has its name" : NULL);
        return;
    }
    status = open_source(all, next, from, old, stop, &loaded, &error);
    if (status == LAM_ERR_CANCELLED) return; /* it is neither served nor refused */
    if (status != LAM_OK) {
        if (old == NULL || check_kept(all, next, old, NULL) != LAM_OK) {
            refuse(all, next, from, &error, NULL);
            return;
        }
        log_line(all->problems, "kept the %s read before; %s cannot be read now: %s", old->name, from->path,
                 error.message);
        refusals_add(next->refused, from->path, from->name, error.message, true);
        loaded = scene_acquire(old);
    }
    (void)insert(next, loaded);
    log_line(all->out, "serving %s: %zu elements, %zu channel%s, %s, from %s", loaded->name, loaded->n,
             loaded->n_channels, loaded->n_channels == 1 ? "" : "s", lam_operator_kind(loaded->op),
             loaded->path);
    if (loaded != old) verifier_add(all->verifier, loaded);
}

void catalog_doubt(catalog *all, const scene *s) {
    const scene *const of = s->base != NULL ? s->base : s;
    if (!scene_may_doubt(of)) return;
    catalog_snapshot *now = catalog_acquire(all);
    for (size_t i = 0; i < now->n_scenes; i++)
        if (now->scenes[i] == of) verifier_add_again(all->verifier, now->scenes[i]);
    catalog_release(now);
}

/* True if the base of a variant is a scene of this snapshot. */
static bool has_base_of(const catalog_snapshot *snapshot, const scene *variant) {
    return catalog_find(snapshot, variant->base->name) == variant->base;
}

/* The oldest variant of a snapshot that was made after number `after`, or NULL. */
static scene *next_variant(const catalog_snapshot *from, uint64_t after) {
    scene *oldest = NULL;
    for (size_t i = 0; i < from->n_scenes; i++) {
        scene *s = from->scenes[i];
        if (s->base != NULL && s->number > after && (oldest == NULL || s->number < oldest->number))
            oldest = s;
    }
    return oldest;
}

/* Adds the variants in `from` whose base is in next, which has places for them. Stores come first: where
 * --max-memory has no room for all, the newest are left out. */
static void keep_variants(catalog *all, catalog_snapshot *next, const catalog_snapshot *from) {
    for (scene *s = NULL; (s = next_variant(from, s == NULL ? 0 : s->number)) != NULL;)
        if (has_base_of(next, s) && check_kept(all, next, s, NULL) == LAM_OK && insert(next, s) == NULL)
            scene_acquire(s);
}

static void report_dropped(const catalog_snapshot *next, const catalog_snapshot *before, FILE *problems) {
    for (size_t i = 0; i < before->n_scenes; i++) {
        const scene *s = before->scenes[i];
        if (s->base == NULL || catalog_find(next, s->name) == s) continue;
        const bool squeezed = has_base_of(next, s) && catalog_find(next, s->name) == NULL;
        log_line(problems, "dropped %s: %s", s->name,
                 squeezed ? "the stores leave it no room in --max-memory"
                          : "its store has changed, or another has its name");
    }
}

/* A copy of the present snapshot without the scene of this name, with room for one more. */
static lam_status copy_without(const catalog_snapshot *present, const char *name, catalog_snapshot **out,
                               lam_error *error) {
    catalog_snapshot *made = NULL;
    const lam_status status = snapshot_create(present->n_scenes + 1, &made, error);
    if (status != LAM_OK) return status;
    for (size_t i = 0; i < present->n_scenes; i++)
        if (strcmp(present->scenes[i]->name, name) != 0)
            made->scenes[made->n_scenes++] = scene_acquire(present->scenes[i]);
    refusals_release(made->refused);
    made->refused = refusals_hold(present->refused);
    *out = made;
    return LAM_OK;
}

lam_status catalog_put_variant(catalog *all, scene *variant, lam_error *error) {
    lam_status status = LAM_OK;
    catalog_snapshot *next = NULL;
    pthread_mutex_lock(&all->lock);
    const scene *taken = catalog_find(all->present, variant->name);
    if (!has_base_of(all->present, variant))
        FAIL(error, LAM_ERR_CANCELLED, "%s is not what it was", variant->base->name);
    if (taken != NULL && taken->base == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "the name %s is taken by a store", variant->name);
    TRY(copy_without(all->present, variant->name, &next, error));
    TRY(check_kept(all, next, variant, error));
    variant->number = ++all->n_variants;
    (void)insert(next, variant);
    variant = NULL;
    catalog_snapshot *old = all->present;
    all->present = next;
    next = old;
    share_memory(all, all->present);
done:
    pthread_mutex_unlock(&all->lock);
    catalog_release(next);
    if (variant != NULL) scene_release(variant);
    return status;
}

lam_status catalog_remove_variant(catalog *all, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    catalog_snapshot *next = NULL;
    pthread_mutex_lock(&all->lock);
    const scene *found = catalog_find(all->present, name);
    if (found == NULL || found->base == NULL) FAIL(error, LAM_ERR_ARGUMENT, "there is no variant %s", name);
    TRY(copy_without(all->present, name, &next, error));
    catalog_snapshot *old = all->present;
    all->present = next;
    next = old;
    share_memory(all, all->present);
done:
    pthread_mutex_unlock(&all->lock);
    catalog_release(next);
    return status;
}

bool catalog_read_all(const catalog *all) {
    return atomic_load(&all->read_all);
}

size_t catalog_stores(catalog *all) {
    source_list sources = {0};
    lam_error unused;
    catalog_snapshot *present = catalog_acquire(all);
    size_t count = 0;
    for (size_t i = 0; i < present->n_scenes; i++) count += present->scenes[i]->base == NULL;
    catalog_release(present);
    if (count == 0 && sources_find(all->config, &sources, &unused) == LAM_OK) count = sources.count;
    sources_free(&sources);
    return count;
}

size_t catalog_reload(catalog *all, const stop_check *stop) {
    source_list sources = {0};
    lam_error error = {0};
    lam_status status = LAM_OK;
    catalog_snapshot *before = catalog_acquire(all), *next = NULL;
    if (all->config->max_memory > 0) atomic_store(&all->ledger.room, 0); /* no scene grows meanwhile */
    TRY(sources_find(all->config, &sources, &error));
    TRY(snapshot_create(sources.count + all->config->max_variants, &next, &error));
    for (size_t i = 0; i < sources.count; i++) {
        load_source(all, next, before, &sources.items[i], stop);
        if (stop_asked(stop))
            FAIL(&error, LAM_ERR_CANCELLED, "left off reading stores at %zu of %zu", i + 1, sources.count);
    }
    pthread_mutex_lock(&all->lock);
    catalog_snapshot *old = all->present;
    keep_variants(all, next,
                  old); /* of the present snapshot, as variants may have been added after `before` */
    atomic_fetch_add(&next->references, 1); /* our own reference, for the report */
    all->present = next;
    pthread_mutex_unlock(&all->lock);
    report_dropped(next, old, all->problems);
    catalog_release(old);
done:
    if (status != LAM_OK) log_line(all->problems, "%s", error.message);
    atomic_store(&all->read_all, status == LAM_OK && next->refused->count == 0);
    catalog_release(next);
    catalog_release(before);
    sources_free(&sources);
    /* Returns the memory of the old stores to the system, so that a daemon does not keep its peak for months.
     */
    (void)malloc_trim(0);
    pthread_mutex_lock(&all->lock);
    share_memory(all, all->present);
    size_t served = all->present->n_scenes;
    pthread_mutex_unlock(&all->lock);
    return served;
}
