#include "server/queue/thread_budget.h"

#include <stdint.h>

/* A loop while it runs, on the stack of the thread that opened it. */
struct open_loop {
    parallel_loop *loop;
    uint64_t free;       /* with bit t: the loop's number t is nobody's */
    size_t n_helpers;    /* threads inside, but for the one that opened it */
    bool done;           /* no piece is left to be taken */
    pthread_cond_t left; /* a helper has left */
    open_loop *next;
};

/* Takes a number below that of the loop's threads, for a thread the same one at every loop if it can, because
 * its caches still hold what it did before. SIZE_MAX: all are taken. */
static size_t take_number(open_loop *open, size_t member) {
    const size_t most = open->loop->n_threads < 64 ? open->loop->n_threads : 64, wanted = member % most;
    if (open->free == 0) return SIZE_MAX;
    const size_t number =
        (open->free >> wanted & 1) != 0 ? wanted : (size_t)__builtin_ctzll((unsigned long long)open->free);
    open->free &= ~((uint64_t)1 << number);
    return number;
}

static void remove_loop(thread_budget *budget, const open_loop *open) {
    open_loop **at = &budget->first;
    while (*at != open) at = &(*at)->next;
    *at = open->next;
}

/* Idle threads take pieces as the calling one does; it waits for those that are not done with theirs. */
static void share(parallel_pool *pool, size_t member, parallel_loop *loop) {
    thread_budget *budget = (thread_budget *)(void *)pool;
    open_loop open = {.loop = loop,
                      .free = loop->n_threads < 64 ? ((uint64_t)1 << loop->n_threads) - 1 : UINT64_MAX};
    const size_t number = take_number(&open, member);
    size_t tried = 0;
    pthread_cond_init(&open.left, NULL);
    pthread_mutex_lock(budget->lock);
    open.next = budget->first;
    budget->first = &open;
    for (size_t wanted = loop->n_threads - 1; wanted > 0; wanted--) pthread_cond_signal(budget->idle);
    pthread_mutex_unlock(budget->lock);
    while (parallel_take(loop, number, &tried)) continue;
    pthread_mutex_lock(budget->lock);
    remove_loop(budget, &open);
    while (open.n_helpers > 0) pthread_cond_wait(&open.left, budget->lock);
    pthread_mutex_unlock(budget->lock);
    pthread_cond_destroy(&open.left);
}

void thread_budget_init(thread_budget *budget, size_t n_threads, pthread_mutex_t *lock,
                        pthread_cond_t *idle) {
    *budget = (thread_budget){.pool = {share, n_threads}, .lock = lock, .idle = idle};
    atomic_init(&budget->called, false);
}

void thread_budget_join(thread_budget *budget, size_t member) {
    parallel_join(&budget->pool, member);
}

/* The loop with the fewest helpers of those that want more, or NULL. */
static open_loop *find_loop(const thread_budget *budget) {
    open_loop *found = NULL;
    for (open_loop *open = budget->first; open != NULL; open = open->next)
        if (!open->done && open->free != 0 && (found == NULL || open->n_helpers < found->n_helpers))
            found = open;
    return found;
}

bool thread_budget_help(thread_budget *budget, size_t member) {
    open_loop *open = find_loop(budget);
    if (open == NULL) return false;
    const size_t number = take_number(open, member);
    size_t tried = 0;
    bool left = true;
    open->n_helpers++;
    atomic_store(&budget->called, false);
    pthread_mutex_unlock(budget->lock);
    while (!atomic_load_explicit(&budget->called, memory_order_relaxed) &&
           (left = parallel_take(open->loop, number, &tried)))
        continue;
    pthread_mutex_lock(budget->lock);
    open->free |= (uint64_t)1 << number;
    if (!left) open->done = true;
    if (--open->n_helpers == 0) pthread_cond_signal(&open->left);
    return true;
}

void thread_budget_call(thread_budget *budget) {
    atomic_store_explicit(&budget->called, true, memory_order_relaxed);
}
