#include "server/scene/scene_texts.h"

#include <string.h>

lam_status scene_texts_describe(scene_texts *texts, const char *description, memory_ledger *ledger,
                                lam_error *error) {
    static const char of[] = "the description of a scene";
    buffer b = {0};
    /* No room is left behind it, as its capacity is kept. */
    if (!buffer_reserve(&b, strlen(description) + 1) || !buffer_append_text(&b, description) ||
        !buffer_append_text(&b, "\n")) {
        buffer_free(&b);
        return status_fail(error, LAM_ERR_MEMORY, "not enough memory for %s", of);
    }
    return kept_forms_of(&b, ledger, of, &texts->description, error);
}

static lam_status add_tiles(scene_texts *texts, const buffer *tiles, const char *format,
                            memory_ledger *ledger, lam_error *error) {
    static const char of[] = "the sky of a scene";
    const char *quote = format != NULL ? "\"" : "";
    buffer b = {0};
    if (!buffer_reserve(&b, tiles->length + 64) || !buffer_append_text(&b, "{") ||
        !buffer_append(&b, tiles->bytes, tiles->length) ||
        !buffer_printf(&b, ",\"weather\":%s%s%s}\n", quote, format != NULL ? format : "null", quote)) {
        buffer_free(&b);
        return status_fail(error, LAM_ERR_MEMORY, "not enough memory for %s", of);
    }
    return kept_forms_of(&b, ledger, of, &texts->sky, error);
}

lam_status scene_texts_add_sky(scene_texts *texts, const buffer *tiles, weather_file *weather,
                               memory_ledger *ledger, uint64_t *memory, lam_error *error) {
    lam_status status = LAM_OK;
    *memory = 0;
    if (tiles->length > 0) {
        TRY(add_tiles(texts, tiles, weather->format, ledger, error));
        *memory = tiles->length;
    }
    if (weather->format != NULL) {
        buffer text = {.bytes = weather->text, .length = weather->length, .capacity = weather->length + 1};
        weather->text = NULL;
        TRY(kept_forms_of(&text, ledger, "the weather of a scene", &texts->weather, error));
    }
done:
    return status;
}

lam_status scene_texts_add_luminaires(scene_texts *texts, buffer *luminaires, memory_ledger *ledger,
                                      uint64_t *memory, lam_error *error) {
    *memory = luminaires->length;
    return luminaires->length == 0
               ? LAM_OK
               : kept_forms_of(luminaires, ledger, "the luminaires of a scene", &texts->luminaires, error);
}

lam_status scene_texts_add_sensors(scene_texts *texts, buffer *sensors, memory_ledger *ledger,
                                   uint64_t *memory, lam_error *error) {
    *memory = sensors->length;
    return sensors->length == 0
               ? LAM_OK
               : kept_forms_of(sensors, ledger, "the sensors of a scene", &texts->sensors, error);
}

lam_status scene_texts_add_groups(scene_texts *texts, buffer *groups, memory_ledger *ledger, uint64_t *memory,
                                  lam_error *error) {
    *memory = groups->length;
    return kept_forms_of(groups, ledger, "the groups of a scene", &texts->groups, error);
}

size_t scene_texts_held(const scene_texts *texts) {
    return kept_forms_held(texts->description) + kept_forms_held(texts->sky) +
           kept_forms_held(texts->luminaires) + kept_forms_held(texts->sensors) +
           kept_forms_held(texts->groups) + kept_forms_held(texts->weather);
}

void scene_texts_clear(const scene_texts *texts) {
    kept_forms_clear(texts->description);
    kept_forms_clear(texts->sky);
    kept_forms_clear(texts->luminaires);
    kept_forms_clear(texts->sensors);
    kept_forms_clear(texts->groups);
    kept_forms_clear(texts->weather);
}

void scene_texts_free(scene_texts *texts) {
    kept_forms_release(texts->description);
    kept_forms_release(texts->sky);
    kept_forms_release(texts->luminaires);
    kept_forms_release(texts->sensors);
    kept_forms_release(texts->groups);
    kept_forms_release(texts->weather);
    *texts = (scene_texts){.description = NULL};
}
