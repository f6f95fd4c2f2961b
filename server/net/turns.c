#include "server/net/turns.h"

#include "server/net/shares.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>

/* Clients that share a place of the table. */
typedef struct place {
    double debt; /* seconds of the thread */
    double idle; /* of the thread, when some of it was taken off the debt */
    turn *first, *last;
} place;

/* The thread that receives calls all functions but turns_close. */
struct turns {
    pthread_mutex_t lock;
    void (*go)(turn *t);
    bool closed;
    uint64_t round;
    size_t n_waiting, n_going;
    size_t latest;                    /* the place that asked last, */
    double latest_seen, another_seen; /* when that was, and when another place asked last */
    place places[SHARES_CLIENTS];
};

lam_status turns_create(void (*go)(turn *t), turns **out, lam_error *error) {
    turns *made = memory_allocate(1, sizeof *made, "turns of clients", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->go = go;
    made->latest_seen = made->another_seen = -TURNS_SEEN_S;
    pthread_mutex_init(&made->lock, NULL);
    *out = made;
    return LAM_OK;
}

void turns_destroy(turns *all) {
    if (all == NULL) return;
    pthread_mutex_destroy(&all->lock);
    free(all);
}

static void let_go(turns *all, place *p) {
    turn *t = p->first;
    p->first = t->next;
    if (p->first == NULL) p->last = NULL;
    t->next = NULL;
    t->waits = false;
    t->goes = true;
    t->round = all->round + 1;
    p->debt += TURNS_COST_S;
    all->n_waiting--;
    all->n_going++;
    all->go(t);
}

/* Lets go those whose turn the next round is: some, if any waits. Rounds in which nobody would are left out.
 */
static void begin_round(turns *all) {
    const size_t waiting = all->n_waiting;
    while (all->n_waiting > 0 && all->n_waiting == waiting)
        for (size_t k = 0; k < SHARES_CLIENTS; k++) {
            place *p = &all->places[k];
            p->debt = fmax(0, p->debt - TURNS_ROUND_S);
            while (p->first != NULL && p->debt < TURNS_ROUND_S) let_go(all, p);
        }
}

static void let_all_go(turns *all) {
    for (size_t k = 0; k < SHARES_CLIENTS; k++)
        while (all->places[k].first != NULL) let_go(all, &all->places[k]);
}

/* One that was let go is back, or is gone: the first of its round ends the round before. */
static void come_back(turns *all, turn *t) {
    t->goes = false;
    all->n_going--;
    const bool first = t->round > all->round;
    if (first) all->round = t->round;
    if (first || all->n_going == 0) begin_round(all);
}

/* True if another place has asked lately. */
static bool see(turns *all, size_t k, double now) {
    if (k != all->latest) {
        all->another_seen = all->latest_seen;
        all->latest = k;
    }
    all->latest_seen = now;
    return now - all->another_seen < TURNS_SEEN_S;
}

static bool may(turns *all, turn *t, double now, double idle) {
    const size_t k = shares_place(t->client);
    place *p = &all->places[k];
    const bool shared = see(all, k, now);
    if (t->goes) {
        come_back(all, t);
        return true;
    }
    /* Where some wait rounds take off, and idle time does not. */
    if (p->first == NULL) p->debt = fmax(0, p->debt - TURNS_FREE * (idle - p->idle));
    p->idle = idle;
    if (all->closed || !shared) {
        p->debt = 0;
        let_all_go(all);
        return true;
    }
    if (p->first != NULL || p->debt >= TURNS_ROUND_S) return false;
    p->debt += TURNS_COST_S;
    return true;
}

bool turns_may(turns *all, turn *t, double now, double idle) {
    pthread_mutex_lock(&all->lock);
    const bool goes_on = may(all, t, now, idle);
    pthread_mutex_unlock(&all->lock);
    return goes_on;
}

void turns_wait(turns *all, turn *t) {
    place *p = &all->places[shares_place(t->client)];
    pthread_mutex_lock(&all->lock);
    t->waits = true;
    t->next = NULL;
    if (p->first == NULL)
        p->first = t;
    else
        p->last->next = t;
    p->last = t;
    all->n_waiting++;
    if (all->closed)
        let_all_go(all);
    else if (all->n_going == 0)
        begin_round(all);
    pthread_mutex_unlock(&all->lock);
}

void turns_charge(turns *all, uint64_t client, double seconds) {
    pthread_mutex_lock(&all->lock);
    all->places[shares_place(client)].debt += seconds;
    pthread_mutex_unlock(&all->lock);
}

static void remove_waiting(turns *all, turn *t) {
    place *p = &all->places[shares_place(t->client)];
    turn *before = NULL;
    for (turn *at = p->first; at != t; at = at->next) before = at;
    if (before == NULL)
        p->first = t->next;
    else
        before->next = t->next;
    if (p->last == t) p->last = before;
    t->waits = false;
    all->n_waiting--;
}

void turns_leave(turns *all, turn *t) {
    pthread_mutex_lock(&all->lock);
    if (t->goes)
        come_back(all, t);
    else if (t->waits)
        remove_waiting(all, t);
    pthread_mutex_unlock(&all->lock);
}

void turns_close(turns *all) {
    pthread_mutex_lock(&all->lock);
    all->closed = true;
    let_all_go(all);
    pthread_mutex_unlock(&all->lock);
}
