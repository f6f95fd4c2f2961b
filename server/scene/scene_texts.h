/* The texts of a scene that clients ask for as they are, made when it is opened, and kept in every coding
 * that was asked for. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_TEXTS_H
#define LAMBERT_SERVER_SCENE_SCENE_TEXTS_H

#include "server/scene/kept_forms.h"
#include "server/scene/weather_file.h"

typedef struct scene_texts {
    kept_forms *description; /* GET /v1/scenes/NAME */
    kept_forms *sky;         /* .../sky; NULL: the store states no tiles, or this is a variant */
    kept_forms *luminaires;  /* .../luminaires; NULL: the store has none, or this is a variant */
    kept_forms *sensors;     /* .../sensors; NULL: the store has none, or this is a variant */
    kept_forms *groups;      /* .../groups */
    kept_forms *weather;     /* .../weather; NULL: there is no file, or this is a variant */
} scene_texts;

/* Adds the description, a line of JSON without its end. Errors, here and below: LAM_ERR_MEMORY. */
lam_status scene_texts_describe(scene_texts *texts, const char *description, memory_ledger *ledger,
                                lam_error *error);

/* Adds the places of tiles (tile_places_read; may be empty), with the format of the weather, and the text of
 * the weather file, which leaves it. *memory: bytes of the places. */
lam_status scene_texts_add_sky(scene_texts *texts, const buffer *tiles, weather_file *weather,
                               memory_ledger *ledger, uint64_t *memory, lam_error *error);

/* Adds the text of luminaires, which leaves it; an empty one is none. *memory: its bytes. */
lam_status scene_texts_add_luminaires(scene_texts *texts, buffer *luminaires, memory_ledger *ledger,
                                      uint64_t *memory, lam_error *error);

/* The same of sensors. */
lam_status scene_texts_add_sensors(scene_texts *texts, buffer *sensors, memory_ledger *ledger,
                                   uint64_t *memory, lam_error *error);

/* The same of groups. */
lam_status scene_texts_add_groups(scene_texts *texts, buffer *groups, memory_ledger *ledger, uint64_t *memory,
                                  lam_error *error);

/* Bytes that they have taken of the ledger since. */
size_t scene_texts_held(const scene_texts *texts);

/* Drops what can be made again. */
void scene_texts_clear(const scene_texts *texts);
void scene_texts_free(scene_texts *texts);

#endif
