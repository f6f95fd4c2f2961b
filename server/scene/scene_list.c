#include "server/scene/scene_list.h"

#include "solver/base/clock.h"
#include "solver/codec/json_writer.h"

#include <pthread.h>

/* A look at a scene asks the system about its file, which takes some tenths of a microsecond: so many are
 * looked at for every request. */
#define FEW 64
#define LOOK_S .1

struct scene_list {
    pthread_mutex_t lock;
    kept_forms *text; /* NULL: not made yet */
    uint64_t mark;    /* of text: which scenes were damaged */
    double looked;    /* clock_seconds */
};

lam_status scene_list_create(scene_list **out, lam_error *error) {
    scene_list *made = memory_allocate(1, sizeof *made, "the list of scenes", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&made->lock, NULL);
    *out = made;
    return LAM_OK;
}

void scene_list_destroy(scene_list *list) {
    if (list == NULL) return;
    kept_forms_release(list->text);
    pthread_mutex_destroy(&list->lock);
    free(list);
}

/* A number for the set of damaged scenes: the polynomial of their flags at an odd number, modulo 2^64. */
static uint64_t mark_of(size_t n_scenes, scene *const *scenes) {
    uint64_t mark = 0;
    for (size_t i = 0; i < n_scenes; i++)
        mark = mark * 0x9e3779b97f4a7c15u + scene_damaged(scenes[i], NULL, NULL);
    return mark;
}

static kept_forms *make(size_t n_scenes, scene *const *scenes, const refusals *refused) {
    kept_forms *text = NULL;
    buffer b = {0};
    lam_error unused;
    size_t listed = 0;
    bool written = buffer_append_text(&b, "{\"scenes\":[");
    for (size_t i = 0; i < n_scenes; i++) {
        const scene *s = scenes[i];
        if (scene_damaged(s, NULL, NULL)) continue;
        written = written && buffer_append_text(&b, listed++ > 0 ? ",{\"name\":" : "{\"name\":") &&
                  json_write_text(&b, s->name) &&
                  buffer_printf(&b, ",\"elements\":%zu,\"channels\":%zu,\"kind\":\"%s\",\"bytes\":%llu}",
                                s->n, s->n_channels, lam_operator_kind(s->op), (unsigned long long)s->bytes);
    }
    if (written && buffer_append(&b, "]", 1) && refusals_write(refused, &b) && buffer_append_text(&b, "}\n"))
        (void)kept_forms_of(&b, NULL, "the list of scenes", &text, &unused);
    buffer_free(&b);
    return text;
}

kept_forms *scene_list_get(scene_list *list, size_t n_scenes, scene *const *scenes, const refusals *refused) {
    const double now = clock_seconds();
    pthread_mutex_lock(&list->lock);
    if (list->text == NULL || n_scenes <= FEW || now >= list->looked + LOOK_S) {
        const uint64_t mark = mark_of(n_scenes, scenes);
        if (list->text == NULL || mark != list->mark) {
            kept_forms_release(list->text);
            list->text = make(n_scenes, scenes, refused);
        }
        list->mark = mark;
        list->looked = now;
    }
    kept_forms *text = kept_forms_hold(list->text);
    pthread_mutex_unlock(&list->lock);
    return text;
}
