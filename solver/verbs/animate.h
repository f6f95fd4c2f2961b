/* lambert render --animate: one picture for each of a sequence of lights, and a video of them. */
#ifndef LAMBERT_VERBS_ANIMATE_H
#define LAMBERT_VERBS_ANIMATE_H

#include "solver/verbs/render_view.h"

/* Draws the frames of f->light beside f->output, IMAGE-0001.png and so on, and makes the video that
 * f->output names, where it is one. The camera and the exposure are those of the whole sequence. Elements
 * behind pixels are found once; answers are found a few frames at a time, twice: for the exposure and for the
 * pictures. When it ends early, the frames that are there are whole, and nothing [80] says how many. Errors:
 * any of a store, of light and of files; LAM_ERR_ARGUMENT where no frame has any light. */
lam_status animate(const char *path, const render_options *f, terminal *t, char nothing[80],
                   lam_error *error);

#endif
