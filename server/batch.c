#include "server/batch.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

struct batch_queue {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    batch_job *first, *last; /* waiting */
    size_t n_jobs;           /* waiting or running */
    size_t max_jobs;
    bool closed;
    size_t n_threads;
    pthread_t threads[];
};

static void *serve(void *argument) {
    batch_queue *queue = argument;
    batch_workspace workspace = {0};
    pthread_mutex_lock(&queue->lock);
    for (;;) {
        while (queue->first == NULL && !queue->closed) pthread_cond_wait(&queue->changed, &queue->lock);
        batch_job *job = queue->first;
        if (job == NULL) break;
        queue->first = job->next;
        if (queue->first == NULL) queue->last = NULL;
        pthread_mutex_unlock(&queue->lock);
        job->run(job, &workspace);
        pthread_mutex_lock(&queue->lock);
        queue->n_jobs--;
        pthread_mutex_unlock(&queue->lock);
        job->finish(job);
        pthread_mutex_lock(&queue->lock);
    }
    pthread_mutex_unlock(&queue->lock);
    free(workspace.bytes);
    return NULL;
}

lam_status batch_start(size_t n_threads, size_t max_jobs, batch_queue **out, lam_error *error) {
    lam_status status = LAM_OK;
    sigset_t all, before;
    batch_queue *queue = memory_allocate(1, sizeof *queue + n_threads * sizeof(pthread_t), "threads", error);
    if (queue == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&queue->lock, NULL);
    pthread_cond_init(&queue->changed, NULL);
    queue->max_jobs = max_jobs;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    for (; queue->n_threads < n_threads; queue->n_threads++)
        if (pthread_create(&queue->threads[queue->n_threads], NULL, serve, queue) != 0) break;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (queue->n_threads < n_threads)
        FAIL(error, LAM_ERR_MEMORY, "cannot start thread %zu of %zu; use fewer --threads",
             queue->n_threads + 1, n_threads);
    *out = queue;
    queue = NULL;
done:
    if (queue != NULL) {
        batch_close(queue);
        batch_destroy(queue);
    }
    return status;
}

bool batch_submit(batch_queue *queue, batch_job *job) {
    job->next = NULL;
    pthread_mutex_lock(&queue->lock);
    bool taken = !queue->closed && queue->n_jobs < queue->max_jobs;
    if (taken) {
        if (queue->last == NULL)
            queue->first = job;
        else
            queue->last->next = job;
        queue->last = job;
        queue->n_jobs++;
        pthread_cond_signal(&queue->changed);
    }
    pthread_mutex_unlock(&queue->lock);
    return taken;
}

size_t batch_jobs(batch_queue *queue) {
    pthread_mutex_lock(&queue->lock);
    size_t n_jobs = queue->n_jobs;
    pthread_mutex_unlock(&queue->lock);
    return n_jobs;
}

void batch_close(batch_queue *queue) {
    pthread_mutex_lock(&queue->lock);
    queue->closed = true;
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->lock);
    for (size_t i = 0; i < queue->n_threads; i++) pthread_join(queue->threads[i], NULL);
}

void batch_destroy(batch_queue *queue) {
    if (queue == NULL) return;
    pthread_cond_destroy(&queue->changed);
    pthread_mutex_destroy(&queue->lock);
    free(queue);
}

void *batch_workspace_get(batch_workspace *workspace, size_t size) {
    if (workspace->size < size) {
        free(workspace->bytes);
        workspace->bytes = malloc(size);
        workspace->size = workspace->bytes == NULL ? 0 : size;
    }
    return workspace->bytes;
}
