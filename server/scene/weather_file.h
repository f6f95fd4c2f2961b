/* The weather beside a store: NAME.epw or NAME.wea beside NAME.h5, as text. Reads its beginning only: a route
 * that needs its rows finds out whether it is sound. */
#ifndef LAMBERT_SERVER_SCENE_WEATHER_FILE_H
#define LAMBERT_SERVER_SCENE_WEATHER_FILE_H

#include "store/status.h"

#include <stddef.h>
#include <stdint.h>

/* A year of an EPW has 1.6 MB. */
#define WEATHER_FILE_MOST ((size_t)8 << 20)

typedef struct weather_file {
    const char *format; /* "epw" or "wea"; NULL: there is none, or none that can be served: */
    char *text;         /* [length]; NULL once another has taken it over */
    size_t length;
    char why[160]; /* the reason, without the folder */
    struct {
        uint64_t device, inode, size;
        int64_t modified_s, modified_ns;
    } identity; /* zeros: there is no file */
} weather_file;

/* Looks for the weather of the store at this path, and reads it where it takes at most `room` bytes. It must
 * be a file whose text begins as its format does, so that nothing else is ever served under its name. A file
 * that is not taken is no error. Freed by weather_file_free. Errors: LAM_ERR_MEMORY. */
lam_status weather_file_read(const char *store_path, uint64_t room, weather_file *out, lam_error *error);
void weather_file_free(weather_file *w);

/* True if what was found then is what would be found now. */
bool weather_file_same(const weather_file *w, const char *store_path);

#endif
