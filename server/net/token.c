#include "server/net/token.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

/* Longest token; most tokens of a file; longest line. */
enum { TOKEN_MOST = 512, TOKENS_MOST = 256, LINE_MOST = 1024 };

typedef struct token {
    token_holder holder;
    size_t length;
    char bytes[TOKEN_MOST];
} token;

typedef struct token_list {
    size_t count;
    bool guards_metrics;
    token items[TOKENS_MOST];
} token_list;

struct tokens {
    const char *path;
    pthread_mutex_t lock;
    token_list *list;
};

static const struct {
    const char *word;
    unsigned right;
} rights[] = {{"read", TOKEN_READ}, {"vary", TOKEN_VARY}, {"metrics", TOKEN_METRICS}};

/* given has TOKEN_MOST bytes, zeros behind its length. All of them are compared, whatever they are. */
static unsigned char differ(const char *given, size_t length, const token *one) {
    unsigned char difference = length != one->length;
    for (size_t i = 0; i < TOKEN_MOST; i++)
        difference |= (unsigned char)given[i] ^ (unsigned char)one->bytes[i];
    return difference;
}

static bool is_name(const char *text) {
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_";
    const size_t length = strlen(text);
    return length > 0 && length < TOKEN_NAME_MAX && strspn(text, letters) == length;
}

/* Takes a word behind the token. */
static bool take_word(const char *word, token *one, bool *guards_metrics) {
    static const char name[] = "name=";
    if (strncmp(word, name, sizeof name - 1) == 0) {
        if (!is_name(word + sizeof name - 1)) return false;
        snprintf(one->holder.name, sizeof one->holder.name, "%s", word + sizeof name - 1);
        return true;
    }
    for (size_t i = 0; i < sizeof rights / sizeof rights[0]; i++) {
        if (strcmp(word, rights[i].word) != 0) continue;
        one->holder.rights |= rights[i].right;
        *guards_metrics = *guards_metrics || rights[i].right == TOKEN_METRICS;
        return true;
    }
    return false;
}

/* Reads a line that holds a token, which is added to the list. Messages must not show a part of it. */
static lam_status read_line(const char *path, size_t number, char *line, token_list *list, lam_error *error) {
    lam_status status = LAM_OK;
    static const char space[] = " \t\r\n";
    char *rest = NULL, *word = strtok_r(line, space, &rest);
    token *one = &list->items[list->count];
    if (word == NULL || word[0] == '#') return LAM_OK;
    if (list->count == TOKENS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s:%zu: there are more than %d tokens", path, number, TOKENS_MOST);
    *one = (token){.length = strlen(word)};
    if (one->length > TOKEN_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s:%zu: the token has %zu characters, must have at most %d", path,
             number, one->length, TOKEN_MOST);
    for (const char *c = word; *c != '\0'; c++)
        if (*c < '!' || *c > '~')
            FAIL(error, LAM_ERR_ARGUMENT, "%s:%zu: the token has a character that no header can hold", path,
                 number);
    memcpy(one->bytes, word, one->length);
    snprintf(one->holder.name, sizeof one->holder.name, "%zu", list->count + 1);
    for (size_t k = 2; (word = strtok_r(NULL, space, &rest)) != NULL; k++)
        if (!take_word(word, one, &list->guards_metrics))
            FAIL(error, LAM_ERR_ARGUMENT,
                 "%s:%zu: word %zu is none of read, vary, metrics and name=TEXT (letters, digits and ._-)",
                 path, number, k);
    if (one->holder.rights == 0) one->holder.rights = TOKEN_ALL;
    for (size_t i = 0; i < list->count; i++)
        if (differ(one->bytes, one->length, &list->items[i]) == 0)
            FAIL(error, LAM_ERR_ARGUMENT, "%s:%zu: this token was given before", path, number);
    list->count++;
done:
    return status;
}

static lam_status read_file(const char *path, FILE *problems, token_list **out, lam_error *error) {
    lam_status status = LAM_OK;
    char line[LINE_MOST + 2];
    struct stat about;
    token_list *list = NULL;
    FILE *file = fopen(path, "re");
    if (file == NULL) FAIL(error, LAM_ERR_IO, "%s: cannot be opened: %s", path, strerror(errno));
    list = memory_allocate(1, sizeof *list, "tokens", error);
    if (list == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t number = 1; fgets(line, sizeof line, file) != NULL; number++) {
        if (strlen(line) > LINE_MOST)
            FAIL(error, LAM_ERR_ARGUMENT, "%s:%zu: the line has more than %d characters", path, number,
                 LINE_MOST);
        TRY(read_line(path, number, line, list, error));
    }
    if (ferror(file)) FAIL(error, LAM_ERR_IO, "%s: cannot be read: %s", path, strerror(errno));
    if (list->count == 0) FAIL(error, LAM_ERR_ARGUMENT, "%s: holds no token", path);
    if (fstat(fileno(file), &about) == 0 && (about.st_mode & S_IROTH) != 0) {
        fprintf(problems, "lambertd: other users can read %s (mode %03o), which holds tokens\n", path,
                (unsigned)about.st_mode & 0777);
        fflush(problems);
    }
    *out = list;
    list = NULL;
done:
    if (list != NULL) explicit_bzero(list, sizeof *list);
    free(list);
    if (file != NULL) fclose(file);
    explicit_bzero(line, sizeof line);
    return status;
}

lam_status tokens_open(const char *path, FILE *problems, tokens **out, lam_error *error) {
    lam_status status = LAM_OK;
    tokens *t = memory_allocate(1, sizeof *t, "tokens", error);
    if (t == NULL) return LAM_ERR_MEMORY;
    t->path = path;
    TRY(read_file(path, problems, &t->list, error));
    pthread_mutex_init(&t->lock, NULL);
    *out = t;
    t = NULL;
done:
    free(t);
    return status;
}

static void free_list(token_list *list) {
    explicit_bzero(list, sizeof *list);
    free(list);
}

void tokens_close(tokens *t) {
    if (t == NULL) return;
    pthread_mutex_destroy(&t->lock);
    free_list(t->list);
    free(t);
}

lam_status tokens_reload(tokens *t, FILE *problems, lam_error *error) {
    lam_status status = LAM_OK;
    token_list *next = NULL;
    if (t == NULL) return LAM_OK;
    TRY(read_file(t->path, problems, &next, error));
    pthread_mutex_lock(&t->lock);
    token_list *before = t->list;
    t->list = next;
    pthread_mutex_unlock(&t->lock);
    free_list(before);
done:
    return status;
}

bool tokens_find(tokens *t, const char *authorization, token_holder *out) {
    static const char scheme[] = "Bearer ";
    *out = (token_holder){.rights = 0};
    if (authorization == NULL || strncasecmp(authorization, scheme, sizeof scheme - 1) != 0) return false;
    const char *given = authorization + sizeof scheme - 1;
    while (*given == ' ') given++;
    const size_t length = strlen(given);
    /* No token is longer, which everybody may know. */
    if (length > TOKEN_MOST) return false;
    char padded[TOKEN_MOST] = {0};
    memcpy(padded, given, length);
    size_t found = SIZE_MAX;
    pthread_mutex_lock(&t->lock);
    for (size_t i = 0; i < t->list->count; i++)
        if (differ(padded, length, &t->list->items[i]) == 0) found = i;
    if (found != SIZE_MAX) *out = t->list->items[found].holder;
    pthread_mutex_unlock(&t->lock);
    explicit_bzero(padded, sizeof padded);
    return found != SIZE_MAX;
}

bool tokens_guard_metrics(tokens *t) {
    pthread_mutex_lock(&t->lock);
    const bool guards = t->list->guards_metrics;
    pthread_mutex_unlock(&t->lock);
    return guards;
}
