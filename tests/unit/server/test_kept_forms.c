/* Bytes that are kept in every form: the same ones for all, within a ledger; and the text of /metrics. */
#include "server/route/metrics_page.h"
#include "server/scene/kept_forms.h"
#include "solver/base/clock.h"
#include "store/store.h"
#include "support/suite.h"

#include <string.h>

static buffer text(const char *of) {
    buffer b = {0};
    ck_assert(buffer_append_text(&b, of));
    return b;
}

START_TEST(forms_are_kept_once_and_within_the_ledger) {
    memory_ledger ledger = {.room = 1000};
    kept_forms *f;
    lam_error error;
    buffer plain = text("plain"), packed = text("packed"), second = text("second");
    const size_t bytes = packed.capacity;
    ck_ok(kept_forms_of(&plain, &ledger, "a text", &f, &error));
    ck_assert_ptr_null(plain.bytes);
    ck_assert_uint_eq(kept_forms_tag(f), store_checksum("plain", 5));
    kept_bytes *found = kept_forms_find(f, 0), *again = kept_forms_find(f, 0);
    ck_assert_ptr_eq(found, again);
    ck_assert_ptr_null(kept_forms_find(f, 1));
    kept_bytes *kept = kept_forms_keep(f, 1, &packed), *other = kept_forms_keep(f, 1, &second);
    ck_assert_ptr_eq(kept, other);
    ck_assert_str_eq(kept->content.bytes, "packed");
    ck_assert_uint_eq(atomic_load(&ledger.taken), bytes);
    ck_assert_uint_eq(kept_forms_held(f), bytes);
    kept_forms_clear(f);
    ck_assert_ptr_null(kept_forms_find(f, 1));
    ck_assert_ptr_eq(kept_forms_find(f, 0), found);
    ck_assert_uint_eq(atomic_load(&ledger.taken), bytes); /* it is still sent */
    kept_bytes_release(kept);
    kept_bytes_release(other);
    ck_assert_uint_eq(atomic_load(&ledger.taken), 0);
    for (int k = 0; k < 3; k++) kept_bytes_release(found);
    kept_forms_release(f);
}
END_TEST

START_TEST(without_room_nothing_is_taken_over) {
    memory_ledger ledger = {.room = 10};
    kept_forms *f;
    lam_error error;
    buffer made = text("some bytes");
    ck_ok(kept_forms_create(&ledger, "a text", &f, &error));
    ck_assert_ptr_null(kept_forms_keep(f, 0, &made));
    ck_assert_str_eq(made.bytes, "some bytes");
    ck_assert_uint_eq(atomic_load(&ledger.taken), 0);
    buffer_free(&made);
    kept_forms_release(f);
}
END_TEST

static bool count(void *context, buffer *b) {
    return buffer_printf(b, "%d", ++*(int *)context);
}

START_TEST(the_page_is_written_ten_times_a_second) {
    metrics_page *page;
    lam_error error;
    int written = 0;
    ck_ok(metrics_page_create(&page, &error));
    const double start = clock_seconds();
    double now = start;
    for (; now < start + 2.5 * METRICS_PAGE_S; now = clock_seconds()) {
        kept_forms *of = metrics_page_get(page, count, &written);
        ck_assert_ptr_nonnull(of);
        kept_forms_release(of);
    }
    ck_assert_int_ge(written, 1);
    ck_assert_int_le(written, 1 + (int)((now - start) / METRICS_PAGE_S));
    metrics_page_destroy(page);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("kept_forms");
    TCase *tests = tcase_create("kept_forms");
    tcase_add_test(tests, forms_are_kept_once_and_within_the_ledger);
    tcase_add_test(tests, without_room_nothing_is_taken_over);
    tcase_add_test(tests, the_page_is_written_ten_times_a_second);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
