#include "server/net/listener.h"

#include <errno.h>
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#define SOCKET_FLAGS (SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC)
#define BACKLOG 1024

static lam_status split_address(const char *address, char *host, size_t host_size, const char **port,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const char *colon = strrchr(address, ':');
    if (colon == NULL || colon[1] == '\0')
        FAIL(error, LAM_ERR_ARGUMENT, "--listen %s: must be HOST:PORT, such as 127.0.0.1:8317", address);
    size_t length = (size_t)(colon - address);
    if (length >= 2 && address[0] == '[' && address[length - 1] == ']') {
        address++;
        length -= 2;
    }
    if (length >= host_size) FAIL(error, LAM_ERR_ARGUMENT, "--listen: the host's name is too long");
    memcpy(host, address, length);
    host[length] = '\0';
    *port = colon + 1;
    /* getaddrinfo truncates a port to 16 bits. */
    if (strspn(*port, "0123456789") != strlen(*port) || strlen(*port) > 5 || atoi(*port) > 65535)
        FAIL(error, LAM_ERR_ARGUMENT, "--listen %s: the port must be from 0 to 65535", address);
done:
    return status;
}

lam_status listener_open_tcp(const char *address, int *fd, char *where, size_t where_size, lam_error *error) {
    lam_status status = LAM_OK;
    char host[256], shown_host[64], shown_port[16];
    const char *port = NULL;
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE | AI_NUMERICSERV};
    struct addrinfo *found = NULL;
    struct sockaddr_storage bound = {0};
    socklen_t bound_size = sizeof bound;
    int s = -1, one = 1;
    TRY(split_address(address, host, sizeof host, &port, error));
    int failed = getaddrinfo(host[0] == '\0' ? NULL : host, port, &hints, &found);
    if (failed != 0) FAIL(error, LAM_ERR_ARGUMENT, "--listen %s: %s", address, gai_strerror(failed));
    s = socket(found->ai_family, SOCKET_FLAGS, 0);
    if (s < 0 || setsockopt(s, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) != 0 ||
        bind(s, found->ai_addr, found->ai_addrlen) != 0 || listen(s, BACKLOG) != 0 ||
        getsockname(s, (struct sockaddr *)&bound, &bound_size) != 0)
        FAIL(error, LAM_ERR_IO, "cannot listen on %s: %s; choose another with --listen", address,
             strerror(errno));
    if (getnameinfo((struct sockaddr *)&bound, bound_size, shown_host, sizeof shown_host, shown_port,
                    sizeof shown_port, NI_NUMERICHOST | NI_NUMERICSERV) != 0)
        FAIL(error, LAM_ERR_IO, "cannot tell what %s is bound to", address);
    bool bracket = strchr(shown_host, ':') != NULL;
    snprintf(where, where_size, "http://%s%s%s:%s", bracket ? "[" : "", shown_host, bracket ? "]" : "",
             shown_port);
    *fd = s;
    s = -1;
done:
    if (found != NULL) freeaddrinfo(found);
    if (s >= 0) close(s);
    return status;
}

lam_status listener_open_unix(const char *path, int *fd, char *where, size_t where_size, unix_socket *own,
                              lam_error *error) {
    lam_status status = LAM_OK;
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    struct stat there;
    int s = -1;
    if (path[0] == '\0' || strlen(path) >= sizeof address.sun_path)
        FAIL(error, LAM_ERR_ARGUMENT, "--unix %s: must have 1 to %zu characters", path,
             sizeof address.sun_path - 1);
    strcpy(address.sun_path, path);
    s = socket(AF_UNIX, SOCKET_FLAGS, 0);
    if (s < 0) FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
    if (lstat(path, &there) == 0 && S_ISSOCK(there.st_mode) &&
        connect(s, (struct sockaddr *)&address, sizeof address) != 0 && errno == ECONNREFUSED)
        unlink(path);
    close(s);
    s = socket(AF_UNIX, SOCKET_FLAGS, 0);
    if (s < 0 || bind(s, (struct sockaddr *)&address, sizeof address) != 0 || listen(s, BACKLOG) != 0)
        FAIL(error, LAM_ERR_IO, "cannot listen on %s: %s", path, strerror(errno));
    snprintf(where, where_size, "unix:%s", path);
    if (lstat(path, &there) == 0)
        *own = (unix_socket){.path = path, .device = there.st_dev, .inode = there.st_ino};
    *fd = s;
    s = -1;
done:
    if (s >= 0) close(s);
    return status;
}

void listener_unlink(unix_socket *own) {
    struct stat there;
    if (own->path != NULL && lstat(own->path, &there) == 0 && there.st_dev == own->device &&
        there.st_ino == own->inode)
        unlink(own->path);
    own->path = NULL;
}
