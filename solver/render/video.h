/* Numbered pictures and videos of them, which ffmpeg makes: the only file that runs it. */
#ifndef LAMBERT_RENDER_VIDEO_H
#define LAMBERT_RENDER_VIDEO_H

#include "solver/base/progress.h"

/* The pictures IMAGE-0001.png ... of an animation with the name IMAGE.png, IMAGE.mp4 or the like,
 * IMAGE-0001.exr ... of IMAGE.exr. They sort by name: all have as many digits, at least 4. */
typedef struct frame_names {
    const char *path; /* borrowed */
    int stem;         /* characters of path before the extension */
    int digits;
    size_t n;
} frame_names;

frame_names frame_names_of(const char *path, size_t n);

/* The name of frame k = 1 ... n, freed with free(). Errors: LAM_ERR_MEMORY. */
lam_status frame_name(const frame_names *names, size_t k, char **name, lam_error *error);

/* True of the extensions of videos: mp4, webm and gif. */
bool video_is_named(const char *path);

/* Makes the video names->path of the frames, fps a second, by running the ffmpeg of the PATH, without a
 * shell. It appears whole or not at all; frames stay. waiting is asked whether to stop where a signal comes.
 * Errors: LAM_ERR_UNSUPPORTED (there is no ffmpeg), LAM_ERR_IO (it failed: the last line that it wrote),
 * LAM_ERR_CANCELLED, LAM_ERR_MEMORY. */
lam_status video_write(const frame_names *names, double fps, const progress *waiting, lam_error *error);

#endif
