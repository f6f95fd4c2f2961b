/* The link to a state of the daemon's page: lights that --emit and --dim ask for, as the fragment of its
 * address. */
#ifndef LAMBERT_VERBS_VIEW_LINK_H
#define LAMBERT_VERBS_VIEW_LINK_H

#include "solver/base/options/options.h"

/* The fragment "#1." and base64url of the JSON that server/viewer/src/state/link.ts reads: the scene of
 * argument (STORE.h5 or STORE.h5:NAME, as the daemon takes it) with the groups of the items GROUP=V or
 * GROUP=V,V,V of emit lit, the luminaires of the items of dim dimmed, and all others dark. *out is freed by
 * the caller; "" without items. Errors: those of a store, LAM_ERR_ARGUMENT (no such group or luminaire, an
 * item that is none, three values where the scene has one channel). */
lam_status view_link(const char *argument, const option_list *emit, const option_list *dim, char **out,
                     lam_error *error);

#endif
