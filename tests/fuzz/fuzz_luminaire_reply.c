/* Replies of the process that reads files of luminaires: sound ones, of which some bytes were changed. */
#include "fuzz/fuzz.h"
#include "solver/luminaire/luminaire_child.h"

#include <sys/mman.h>
#include <unistd.h>

/* The bytes that the child sends. */
typedef struct sent {
    uint8_t *bytes;
    size_t length;
} sent;

static void send_bytes(void *context) {
    const sent *s = context;
    (void)confined_send(CONFINED_REPLY, s->bytes, s->length);
}

static sent make_reply(void) {
    static const char text[] =
        "IESNA91\n[A] b\n[C] d\nTILT=INCLUDE\n1 2 0 90 1 .5\n1 100 1 2 3 1 2 .1 .2 .3\n1 1 1\n"
        "0 90\n0 120 240\n1 2 3 4 5 6\n";
    const luminaire_options options = {.set = 0};
    lam_error error = {.message = ""};
    luminaire l = {.n_planes = 0};
    const int fd = memfd_create("reply", 0);
    FUZZ_CHECK(fd >= 0 && luminaire_read_text("a", text, strlen(text), &options, &l, &error) == LAM_OK);
    FUZZ_CHECK(luminaire_send(fd, LAM_OK, &error, &l));
    luminaire_free(&l);
    sent s = {.length = (size_t)lseek(fd, 0, SEEK_END)};
    s.bytes = malloc(s.length);
    FUZZ_CHECK(s.bytes != NULL && pread(fd, s.bytes, s.length, 0) == (ssize_t)s.length);
    close(fd);
    return s;
}

/* Each three bytes are a place and its new value; one byte that is left cuts the end off. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    sent s = make_reply();
    const size_t whole = s.length;
    luminaire l = {.n_planes = 0};
    lam_error error = {.message = ""};
    for (size_t k = 0; k + 2 < size; k += 3) s.bytes[(data[k] | data[k + 1] << 8) % (int)whole] = data[k + 2];
    if (size % 3 == 1) s.length -= data[size - 1] < whole ? data[size - 1] : whole;
    if (luminaire_receive(send_bytes, &s, "a", &l, &error) == LAM_OK) {
        double C = 0, gamma = 0;
        FUZZ_CHECK(luminaire_is_sound(&l));
        FUZZ_CHECK(luminaire_candela(&l, 1, 2) <= luminaire_peak(&l, &C, &gamma) * (1 + 1e-9));
        FUZZ_CHECK(luminaire_format_name(l.format) != NULL && luminaire_shape_name(l.opening.shape) != NULL);
    } else {
        FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
    }
    luminaire_free(&l);
    free(s.bytes);
    return 0;
}
