#include "server/route/metrics_page.h"

#include "solver/base/clock.h"

#include <pthread.h>

struct metrics_page {
    pthread_mutex_t lock;
    kept_forms *text; /* NULL: it was not written yet */
    double written;   /* clock_seconds */
};

lam_status metrics_page_create(metrics_page **out, lam_error *error) {
    metrics_page *made = memory_allocate(1, sizeof *made, "metrics", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&made->lock, NULL);
    *out = made;
    return LAM_OK;
}

void metrics_page_destroy(metrics_page *page) {
    if (page == NULL) return;
    kept_forms_release(page->text);
    pthread_mutex_destroy(&page->lock);
    free(page);
}

kept_forms *metrics_page_get(metrics_page *page, bool (*write)(void *context, buffer *b), void *context) {
    pthread_mutex_lock(&page->lock);
    const double now = clock_seconds();
    if (page->text == NULL || now >= page->written + METRICS_PAGE_S) {
        lam_error unused;
        buffer b = {0};
        kept_forms_release(page->text);
        page->text = NULL;
        page->written = now;
        if (write(context, &b)) (void)kept_forms_of(&b, NULL, "the text of /metrics", &page->text, &unused);
        buffer_free(&b);
    }
    kept_forms *text = kept_forms_hold(page->text);
    pthread_mutex_unlock(&page->lock);
    return text;
}
