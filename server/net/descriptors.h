/* The number of connections that the limit on open files allows. Any thread. */
#ifndef LAMBERT_SERVER_NET_DESCRIPTORS_H
#define LAMBERT_SERVER_NET_DESCRIPTORS_H

#include "server/net/connections.h"

/* limits->most: the number of connections that the process has descriptors for, at most `wanted`, beside
 * those of n_stores mapped stores and of other files; some, even if these take all. Raises the soft limit to
 * the hard one. Errors: LAM_ERR_IO if there are none. */
lam_status descriptors_afford(connection_limits *limits, size_t n_stores, lam_error *error);

/* True if the process may open no file any more; nobody is accepted then, however few are connected. */
bool descriptors_are_out(void);

#endif
