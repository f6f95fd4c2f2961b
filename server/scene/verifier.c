#include "server/scene/verifier.h"

#include "server/scene/log_line.h"
#include "server/scene/map_guard.h"
#include "solver/base/clock.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

/* Requests have priority: about a tenth of a core is left for this thread while they use all of it. */
#define NICENESS 10

struct verifier {
    FILE *out, *problems;
    verifier_scrub scrub;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    scene *first, **end; /* waiting, each held */
    atomic_int stopped;
};

static bool is_stopped(void *context) {
    verifier *v = context;
    return atomic_load(&v->stopped) != 0;
}

void verifier_report_damage(FILE *problems, const scene *s, const lam_error *why) {
    log_line(problems, "took %s out of service: %s", s->name, why->message);
}

static void verify(verifier *v, scene *s) {
    lam_error error;
    bool news;
    /* This thread has the only reference: the scene was replaced while it waited. */
    if (atomic_load(&s->references) == 1) return;
    const stop_check stop = {is_stopped, v};
    const lam_status status = scene_verify(s, &stop, &error);
    if (scene_damaged(s, &error, &news)) {
        if (news) verifier_report_damage(v->problems, s, &error);
    } else if (status == LAM_OK) {
        log_line(v->out, "verified %s: %zu bytes", s->name, store_map_bytes(s->map));
    }
}

/* The caller holds the lock. Waits for a scene to verify or the end; lists scenes again when it is time. */
static void wait_for_scene(verifier *v) {
    struct timespec due = clock_now();
    const double seconds = v->scrub.hours * 3600;
    due.tv_sec += (time_t)seconds;
    due.tv_nsec += (long)((seconds - (double)(time_t)seconds) * 1e9);
    if (due.tv_nsec >= 1000000000) {
        due.tv_nsec -= 1000000000;
        due.tv_sec++;
    }
    while (v->first == NULL && atomic_load(&v->stopped) == 0) {
        if (v->scrub.hours <= 0) {
            pthread_cond_wait(&v->changed, &v->lock);
        } else if (pthread_cond_timedwait(&v->changed, &v->lock, &due) == ETIMEDOUT) {
            pthread_mutex_unlock(&v->lock);
            v->scrub.list(v->scrub.context, v);
            pthread_mutex_lock(&v->lock);
            return;
        }
    }
}

static void *run(void *argument) {
    verifier *v = argument;
    (void)setpriority(PRIO_PROCESS, (id_t)gettid(), NICENESS);
    map_guard_allow();
    pthread_mutex_lock(&v->lock);
    while (atomic_load(&v->stopped) == 0) {
        scene *s = v->first;
        if (s == NULL) {
            wait_for_scene(v);
            continue;
        }
        v->first = s->next_to_verify;
        if (v->first == NULL) v->end = &v->first;
        s->to_verify = false;
        pthread_mutex_unlock(&v->lock);
        verify(v, s);
        scene_release(s);
        pthread_mutex_lock(&v->lock);
    }
    pthread_mutex_unlock(&v->lock);
    return NULL;
}

lam_status verifier_start(FILE *out, FILE *problems, const verifier_scrub *scrub, verifier **made,
                          lam_error *error) {
    lam_status status = LAM_OK;
    pthread_condattr_t monotonic;
    sigset_t all, before;
    verifier *v = memory_allocate(1, sizeof *v, "threads", error);
    if (v == NULL) return LAM_ERR_MEMORY;
    v->out = out;
    v->problems = problems;
    v->scrub = *scrub;
    v->end = &v->first;
    atomic_init(&v->stopped, 0);
    pthread_mutex_init(&v->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&v->changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const int failed = pthread_create(&v->thread, NULL, run, v);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (failed != 0) FAIL(error, LAM_ERR_MEMORY, "cannot start a thread that verifies stores");
    *made = v;
    v = NULL;
done:
    free(v);
    return status;
}

/* Queues it, unless it waits already. */
static void add(verifier *v, scene *s) {
    pthread_mutex_lock(&v->lock);
    if (!s->to_verify) {
        s->to_verify = true;
        s->next_to_verify = NULL;
        *v->end = scene_acquire(s);
        v->end = &s->next_to_verify;
        pthread_cond_signal(&v->changed);
    }
    pthread_mutex_unlock(&v->lock);
}

void verifier_add(verifier *v, scene *s) {
    if (!scene_verified(s)) add(v, s);
}

void verifier_add_again(verifier *v, scene *s) {
    if (s->base == NULL && s->map != NULL && !scene_damaged(s, NULL, NULL)) add(v, s);
}

void verifier_stop(verifier *v) {
    if (v == NULL) return;
    pthread_mutex_lock(&v->lock);
    atomic_store(&v->stopped, 1);
    pthread_cond_signal(&v->changed);
    pthread_mutex_unlock(&v->lock);
    pthread_join(v->thread, NULL);
    while (v->first != NULL) {
        scene *s = v->first;
        v->first = s->next_to_verify;
        scene_release(s);
    }
    pthread_cond_destroy(&v->changed);
    pthread_mutex_destroy(&v->lock);
    free(v);
}
